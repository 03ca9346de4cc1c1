"""Implementations of the papers, one package each. `texrs` exports their functions."""
