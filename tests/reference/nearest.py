"""The nearest of many vectors by comparing with all of them."""

import numpy as np


def nearest(vectors, queries, own=False):
    """Return which vector is nearest to each query, the first of equal ones, and how far it is."""
    which, apart = [], []
    for number, query in enumerate(queries):
        square = ((vectors - query) ** 2).sum(axis=1)
        if own:
            square[number] = np.inf
        which.append(int(square.argmin()))
        apart.append(np.sqrt(square[which[-1]]))
    return np.array(which), np.array(apart)
