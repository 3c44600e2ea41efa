//! The `stagger` program: see `stagger help`.

fn main() -> std::process::ExitCode {
    stagger_nodes::cli::main()
}
