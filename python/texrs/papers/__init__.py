"""One paper a file, each read from top to bottom; the verbs are exported by `texrs` itself."""
