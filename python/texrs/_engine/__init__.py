"""Python interface of the compiled engine for synthesis by source coordinates: regions, appearance, seams, noise."""
