//! Compiles the schemas without protoc, and keeps their descriptors for the recordings.

use std::{env, fs, path::PathBuf};

use prost::Message as _;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let files = ["proto/field.proto", "proto/control.proto"];
    println!("cargo:rerun-if-changed=proto");
    let descriptors = protox::compile(files, ["proto"])?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    // Recordings embed the descriptors; comments would only make them larger.
    let mut bare = descriptors.clone();
    for file in &mut bare.file {
        file.source_code_info = None;
    }
    fs::write(out.join("descriptors.bin"), bare.encode_to_vec())?;
    let mut config = prost_build::Config::new();
    config.btree_map(["."]);
    config.type_attribute(".stagger.v1.Version", "#[derive(PartialOrd, Ord, serde::Serialize, serde::Deserialize)]");
    config.compile_fds(descriptors)?;
    Ok(())
}
