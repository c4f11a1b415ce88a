"""A part of a few lines under the contract of the real ones, packed into FMUs by the tests."""
