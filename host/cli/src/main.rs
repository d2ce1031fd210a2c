//! The `giotto` command: a thin face over the library.
#![forbid(unsafe_code)]

use std::process::ExitCode;

fn main() -> ExitCode {
    giotto_cli::main()
}
