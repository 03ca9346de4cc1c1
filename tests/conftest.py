"""What all tests share."""

from hypothesis import settings

# The same cases each time; `--hypothesis-profile=default` explores others.
settings.register_profile("fixed", derandomize=True, deadline=None)
settings.load_profile("fixed")
