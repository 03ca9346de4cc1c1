"""Stored digests of results, for changes that must keep the same bytes.

Each case is a small function that computes a result through the public interface and returns its parts. `digests.json`
contains the digest of every part. `tests/test_truth.py` compares them, for several numbers of threads. A change that
intentionally alters results rewrites the whole table, and the diff shows the altered parts:

    REGENERATE=1 python -m pytest tests/test_truth.py
"""
