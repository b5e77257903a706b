//! Cross-crate scenarios live in `tests/` beside this; the library is empty on purpose.
