//! The `giotto` command.
fn main() {}
