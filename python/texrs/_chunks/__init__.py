"""Compute and store arrays larger than memory in chunks: grids of chunks, workers, Zarr stores and plain files."""
