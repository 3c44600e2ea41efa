//! Compiles the schemas that other programs' viewers read, without protoc, and keeps their descriptors for the recordings.

use std::{env, fs, path::PathBuf};

use prost::Message as _;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    println!("cargo:rerun-if-changed=proto");
    // With everything they import: a recording must be readable by itself.
    let files = ["foxglove/PointCloud.proto", "foxglove/Log.proto", "display.proto"];
    let descriptors = protox::compile(files, ["proto"])?;
    let mut bare = descriptors.clone();
    for file in &mut bare.file {
        file.source_code_info = None;
    }
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("display.bin"), bare.encode_to_vec())?;
    prost_build::Config::new().compile_fds(descriptors)?;
    Ok(())
}
