"""What all tests share."""

import os

from hypothesis import settings

settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("fuzz", max_examples=2000, deadline=None, print_blob=True)
# The same cases each time; new ones where they are asked for.
settings.load_profile("fuzz" if os.environ.get("TEXRS_FUZZ", "0") not in ("", "0") else "fixed")
