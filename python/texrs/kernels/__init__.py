"""The kernels, one module each: checked, documented wrappers of the compiled code, for reuse.

Each is a noun of the literature and knows nothing of the papers that use it.
"""
