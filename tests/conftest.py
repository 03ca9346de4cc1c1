"""What all tests share."""

from hypothesis import settings

settings.register_profile("fixed", derandomize=True, deadline=None)
settings.register_profile("fuzz", deadline=None, print_blob=True)
# The same cases each time; `make fuzz` asks for the other profile, with a seed of its own.
settings.load_profile("fixed")
