//! Hardware in the loop.
fn main() {}
