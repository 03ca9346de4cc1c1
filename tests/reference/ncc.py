"""Normalised cross-correlation by definition, one window at a time."""

import numpy as np


def maps(image, template):
    """Return the correlation coefficients of all windows, channel by channel, (H - h + 1, W - w + 1, C)."""
    image, template = np.asarray(image, np.float64), np.asarray(template, np.float64)
    rows, columns = (image.shape[a] - template.shape[a] + 1 for a in range(2))
    found = np.zeros((rows, columns, image.shape[2]))
    centred = template - template.mean(axis=(0, 1))
    for i in range(rows):
        for j in range(columns):
            window = image[i : i + template.shape[0], j : j + template.shape[1]]
            window = window - window.mean(axis=(0, 1))
            energy = np.sqrt((window**2).sum(axis=(0, 1)) * (centred**2).sum(axis=(0, 1)))
            product = (window * centred).sum(axis=(0, 1))
            found[i, j] = np.where(energy > 1e-9, product / np.maximum(energy, 1e-9), 0)
    return found
