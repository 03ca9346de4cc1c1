"""Stored texts of what users see: signatures, help texts, and the answers to unsuitable values.

- ``signatures.txt``: a line for each public function, class and method.
- ``help.txt``: the help of each command, 100 columns wide.
- ``refusals.txt`` and ``refusals_of_modules.txt``: a line for each parameter and each answer. The line
  ``texrs.design(seed=None nan -1) InvalidInput: seed: must be ..., got ~`` contains the unsuitable values, the class of
  the error and its message. ``~`` is the given value, TYPE is its type, and TMP is a temporary folder.
"""
