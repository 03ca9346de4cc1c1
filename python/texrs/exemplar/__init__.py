"""What an exemplar is: its pixels, the channels that guide, features, labels, repeats, layers and scaled copies."""
