"""What is too large for one call, in chunks: which there are, who makes them, and where they are kept."""
