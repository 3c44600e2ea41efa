//! The files a scene names: beside it, or in a recording of it.

use std::path::Path;

use stagger_recordings::Recording;
use stagger_solver::scene::{Problems, Scene};

/// Parses the scene in the file `scene`. Relative paths in it begin at its folder; what is not there is taken from
/// `recording`, where one is given.
///
/// # Errors
/// Every mistake in the scene, a file that cannot be read included.
pub fn parse(
    text: &str,
    scene: &Path,
    overrides: &[(String, String)],
    recording: Option<&Path>,
) -> Result<Scene, Problems> {
    let read = |path: &str| {
        let beside = crate::bounded::read(&scene.parent().unwrap_or(Path::new("")).join(path));
        beside.or_else(|error| match recording.map(Recording::open) {
            None => Err(error.to_string()),
            Some(Ok(recording)) => recording.info.file(path).map_err(|also| format!("{error}, and {also}")),
            Some(Err(also)) => Err(format!("{error}, and {also}")),
        })
    };
    Scene::parse_with_files(text, &scene.display().to_string(), overrides, &read)
}

#[cfg(test)]
mod tests {
    use stagger_recordings::RunInfo;

    use super::*;

    const SCENE: &str =
        "duration = 1\n[particles]\nstart = { kind = \"file\", path = \"bed.csv\" }\n[coupling]\ndt = 1\n";

    #[test]
    fn a_file_is_read_beside_the_scene_and_changes_its_hash() {
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.toml");
        let read = || parse(SCENE, &scene, &[], None);
        let message = read().unwrap_err().to_string();
        assert!(message.contains("particles.start.path: cannot read \"bed.csv\": No such file"), "{message}");
        std::fs::write(folder.path().join("bed.csv"), "x,y,z,radius\n0,0,0,1\n").unwrap();
        let first = read().unwrap();
        std::fs::write(folder.path().join("bed.csv"), "x,y,z,radius\n0,0,1,1\n").unwrap();
        assert_ne!(read().unwrap().hash, first.hash);

        // The recorded contents do where the file is gone, and give the same scene.
        let info = RunInfo {
            scene_text: SCENE.into(),
            scene_file: scene.display().to_string(),
            files: first.files.clone(),
            ..RunInfo::default()
        };
        std::fs::remove_file(folder.path().join("bed.csv")).unwrap();
        assert_eq!(info.scene().unwrap().hash, first.hash);
        let recording = folder.path().join("run.mcap");
        let written =
            stagger_recordings::Recorder::create(std::fs::File::create(&recording).unwrap(), &info, Default::default())
                .unwrap();
        written.finish().unwrap();
        assert_eq!(parse(SCENE, &scene, &[], Some(&recording)).unwrap().hash, first.hash);
    }
}
