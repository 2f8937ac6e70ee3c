"""Value types and scalar-generic maths that every kernel builds on."""
