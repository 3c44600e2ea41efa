//! A scene's file and the files it names: beside it, or in a recording of it. What can be read only once, such as standard
//! input or a pipe, is read once.

use std::{
    cell::RefCell,
    collections::BTreeMap,
    fs::{self, File},
    io::{self, Read as _},
    path::{Path, PathBuf},
    sync::mpsc::RecvTimeoutError,
    time::Duration,
};

use stagger_config::Problems;
use stagger_recordings::Recording;
use stagger_scene::Scene;

use crate::diagnostics;

/// The scene that is read from standard input, as on other programs' command lines.
const STDIN: &str = "-";
/// What such a scene is called.
const NAME_OF_STDIN: &str = "stdin";
/// How long a pipe may have nobody at its other end before a word is said, and before it is given up.
const PIPE: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(30)];
/// More than this, in bytes, does not come from a pipe but from a device without an end.
const MOST: u64 = 1 << 30;

/// A scene's text as it was read, and where its files are.
#[derive(Debug)]
pub struct SceneFile {
    /// Its path; `stdin` where it came from there.
    pub path: PathBuf,
    /// Its text.
    pub text: String,
    /// Where relative paths in it begin.
    folder: PathBuf,
    /// Whether another process finds the same under its path.
    stays: bool,
    /// What cannot be read a second time.
    once: RefCell<BTreeMap<PathBuf, Vec<u8>>>,
}

impl SceneFile {
    /// Reads the scene in a file, or on standard input where the path is `-`.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn read(path: &Path) -> io::Result<Self> {
        let (text, path, folder, stays) = if path == Path::new(STDIN) {
            (io::read_to_string(io::stdin().lock())?, Path::new(NAME_OF_STDIN), Path::new(""), false)
        } else if stays(path) {
            (fs::read_to_string(path)?, path, path.parent().unwrap_or(Path::new("")), true)
        } else {
            let text = String::from_utf8(read_once(path)?)
                .map_err(|_| io::Error::new(io::ErrorKind::InvalidData, "stream did not contain valid UTF-8"))?;
            (text, path, Path::new(""), false)
        };
        Ok(Self { path: path.into(), text, folder: folder.into(), stays, once: RefCell::default() })
    }

    /// Parses it. Relative paths in it begin at its folder, or at the working directory where it has none; what is not there is
    /// taken from `recording`, where one is given.
    ///
    /// # Errors
    /// Every mistake in the scene, a file that cannot be read included.
    pub fn parse(&self, overrides: &[(String, String)], recording: Option<&Path>) -> Result<Scene, Problems> {
        let read = |path: &str| {
            let beside = self.beside(&self.folder.join(path), recording.is_some());
            beside.or_else(|error| match recording.map(Recording::open) {
                None => Err(error.to_string()),
                Some(Ok(recording)) => recording.info.file(path).map_err(|also| format!("{error}, and {also}")),
                Some(Err(also)) => Err(format!("{error}, and {also}")),
            })
        };
        Scene::parse_with_files(&self.text, &self.path.display().to_string(), overrides, &read)
    }

    /// The contents of a file on this host; where they may be `recorded`, those of a pipe are, as they came only once.
    fn beside(&self, path: &Path, recorded: bool) -> io::Result<Vec<u8>> {
        if stays(path) {
            return crate::bounded::read(path);
        }
        if recorded {
            return Err(io::Error::other("it can be read only once"));
        }
        if let Some(contents) = self.once.borrow().get(path) {
            return Ok(contents.clone());
        }
        let contents = read_once(path)?;
        self.once.borrow_mut().insert(path.into(), contents.clone());
        Ok(contents)
    }

    /// The files that a scene parsed from this was read from, its own first, and what they are to it.
    pub fn files(&self, scene: &Scene) -> impl Iterator<Item = (&'static str, PathBuf)> {
        let own = self.stays.then(|| ("the scene", self.path.clone()));
        own.into_iter().chain(scene.files.keys().map(|path| ("a file of the scene", self.folder.join(path))))
    }

    /// Whether another process can read this, and all files of a scene parsed from it, as this one did.
    #[must_use]
    pub fn can_be_read_again(&self, scene: &Scene) -> bool {
        self.stays && scene.files.keys().all(|path| stays(&self.folder.join(path)))
    }
}

/// Whether a path leads to the same contents again: a file, and not what stands for an open one of this process.
fn stays(path: &Path) -> bool {
    let open = ["/dev/fd", "/dev/stdin", "/proc"].iter().any(|system| path.starts_with(system));
    // What is not there, or is a folder, is told by whoever reads it.
    !open && fs::metadata(path).map_or(true, |about| about.is_file() || about.is_dir())
}

/// Reads what can be read only once. A pipe that nobody writes to is not waited for longer than somebody takes to begin.
fn read_once(path: &Path) -> io::Result<Vec<u8>> {
    let mut contents = Vec::new();
    let what = path.to_owned();
    let input = patiently(&format!("somebody to write to {}", path.display()), || false, move || File::open(what))?;
    if input.take(MOST).read_to_end(&mut contents)? as u64 == MOST {
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, format!("it is larger than {} MiB", MOST >> 20)));
    }
    Ok(contents)
}

/// Opens a pipe that nobody may hold the other end of. Opening blocks and cannot be ended, so that a thread does it, which is
/// left to the end of the process where nobody comes.
///
/// # Errors
/// Nobody comes, `given_up` says that it is not to be waited for any longer, or it cannot be opened.
pub fn patiently<T: Send + 'static>(
    awaited: &str,
    given_up: impl Fn() -> bool,
    open: impl FnOnce() -> io::Result<T> + Send + 'static,
) -> io::Result<T> {
    const LOOK: Duration = Duration::from_millis(20);
    let [word, patience] = PIPE;
    let (opened, opening) = std::sync::mpsc::channel();
    std::thread::Builder::new().name("opening".into()).spawn(move || opened.send(open()))?;
    let begun = std::time::Instant::now();
    let mut told = false;
    loop {
        match opening.recv_timeout(LOOK) {
            Ok(result) => return result,
            Err(RecvTimeoutError::Disconnected) => return Err(io::Error::other("it cannot be opened")),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if given_up() {
            return Err(io::ErrorKind::Interrupted.into());
        }
        if begun.elapsed() >= patience {
            return Err(io::Error::new(io::ErrorKind::TimedOut, format!("waited in vain for {awaited}")));
        }
        if begun.elapsed() >= word && !std::mem::replace(&mut told, true) {
            diagnostics::note(&format!("waiting for {awaited}"));
        }
    }
}

/// A setting as it is typed: `KEY=VALUE`.
///
/// # Errors
/// There is no `=` in it.
pub fn key_value(text: &str) -> Result<(String, String), String> {
    let (key, value) = text.split_once('=').ok_or_else(|| format!("expected KEY=VALUE, found `{text}`"))?;
    Ok((key.trim().into(), value.trim().into()))
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
        fs::write(&scene, SCENE).unwrap();
        let file = SceneFile::read(&scene).unwrap();
        let read = || file.parse(&[], None);
        let message = read().unwrap_err().to_string();
        assert!(message.contains("particles.start.path: cannot read \"bed.csv\": No such file"), "{message}");
        fs::write(folder.path().join("bed.csv"), "x,y,z,radius\n0,0,0,1\n").unwrap();
        let first = read().unwrap();
        fs::write(folder.path().join("bed.csv"), "x,y,z,radius\n0,0,1,1\n").unwrap();
        assert_ne!(read().unwrap().hash, first.hash);

        // The recorded contents do where the file is gone, and give the same scene.
        let info = RunInfo {
            scene_text: SCENE.into(),
            scene_file: scene.display().to_string(),
            files: first.files.clone(),
            ..RunInfo::default()
        };
        fs::remove_file(folder.path().join("bed.csv")).unwrap();
        assert_eq!(info.scene().unwrap().hash, first.hash);
        let recording = folder.path().join("run.mcap");
        let written =
            stagger_recordings::Recorder::create(File::create(&recording).unwrap(), &info, Default::default()).unwrap();
        written.finish().unwrap();
        assert_eq!(file.parse(&[], Some(&recording)).unwrap().hash, first.hash);
    }
}
