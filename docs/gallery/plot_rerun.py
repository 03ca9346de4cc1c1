"""
Repeat a result
===============

Every file contains a record of the command that wrote it. ``texrs rerun`` repeats the command. The result has the same
bytes, or a message names the input that has changed.
"""

import contextlib
import io
import os
import tempfile

import matplotlib.pyplot as plt

import texrs
from texrs.cli import main

here = os.getcwd()
with tempfile.TemporaryDirectory() as folder, contextlib.redirect_stderr(io.StringIO()):
    os.chdir(folder)
    main(["design", "sample:beans", "-o", "beans.png", "--size", "480x200", "--seed", "11"])
    main(["info", "beans.png"])
    main(["rerun", "beans.png"])
    made = texrs.io.read("beans.png")
    os.chdir(here)

figure, axes = plt.subplots(figsize=(11, 4.8), layout="constrained")
axes.imshow(made)
axes.set_axis_off()
plt.show()
