"""Tests of where kernels are kept, and of who compiles them."""
