"""Stored digests of results: what a change that promises the same bytes is held to.

Each case is a small function that makes something through the public interface and returns its parts; `digests.json`
keeps what every part came to. `tests/test_truth.py` compares them, for several numbers of threads. A change that is
meant to alter results rewrites the whole table, which shows in the diff what it altered:

    REGENERATE=1 python -m pytest tests/test_truth.py
"""
