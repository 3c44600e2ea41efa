//! The `stagger` program: see `stagger help`.

use clap::Parser as _;

fn main() -> std::process::ExitCode {
    stagger_nodes::cli::main(stagger_nodes::cli::Arguments::parse())
}
