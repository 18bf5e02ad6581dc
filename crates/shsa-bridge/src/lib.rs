//! Middleware: how observations come in and substitutes go out.
