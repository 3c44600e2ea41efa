//! What a command writes: never over what it reads, not over what is there unless asked to, and whole or not at all.

use std::{
    fs::{self, File, FileType, OpenOptions},
    io::{self, ErrorKind, Read as _, Write as _},
    os::unix::fs::{FileTypeExt as _, MetadataExt as _},
    path::{Path, PathBuf},
    sync::atomic::{AtomicU64, Ordering},
};

/// What the names of files under way begin and end with.
const PART: [&str; 2] = [".stagger-", ".part"];
/// Symbolic links that are followed to a file that is not there yet, as the system does.
const LINKS: usize = 40;

/// Why a file is not written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// It is read.
    #[error("{} is {what}, which this command reads: it is not written over\nhint: write to another file", .path.display())]
    Input {
        /// The file.
        path: PathBuf,
        /// What it is to the command.
        what: String,
    },
    /// Something is there.
    #[error("{} exists already\nhint: --overwrite replaces it; or write to another file", .0.display())]
    Exists(PathBuf),
    /// A run that goes on writes it.
    #[error("{} is still being written by a run: it is not replaced", .0.display())]
    UnderWay(PathBuf),
    /// Nothing that can be written to.
    #[error("{} is {what}: expected the name of a file", .path.display())]
    NoFile {
        /// Its path.
        path: PathBuf,
        /// What it is.
        what: &'static str,
    },
    /// The system refuses.
    #[error("cannot write {}: {source}", .path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
}

impl OutputError {
    fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { path: path.into(), source }
    }

    /// Whether another name or `--overwrite` mends it, so that it is the user's to decide.
    #[must_use]
    pub fn is_refusal(&self) -> bool {
        !matches!(self, Self::Io { .. })
    }
}

/// The files a command reads: none of them may be one it writes, by whatever name or link it is called.
#[derive(Clone, Debug, Default)]
pub struct Inputs(Vec<Input>);

#[derive(Clone, Debug)]
struct Input {
    what: String,
    identity: (u64, u64),
}

/// Device and inode: what makes a file itself.
fn identity(path: &Path) -> Option<(u64, u64)> {
    fs::metadata(path).ok().map(|about| (about.dev(), about.ino()))
}

impl Inputs {
    /// None yet.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// With one more; one that is not there is none.
    #[must_use]
    pub fn with(mut self, what: &str, path: &Path) -> Self {
        self.add(what, path);
        self
    }

    /// Adds one; one that is not there is none.
    pub fn add(&mut self, what: &str, path: &Path) {
        // A terminal or a null device may be read and written at once.
        let file = fs::metadata(path).is_ok_and(|about| about.is_file());
        self.0.extend(identity(path).filter(|_| file).map(|identity| Input { what: what.into(), identity }));
    }

    /// Refuses an output that is one of them.
    ///
    /// # Errors
    /// It is.
    pub fn spare(&self, output: &Path) -> Result<(), OutputError> {
        let same = identity(output).and_then(|identity| self.0.iter().find(|input| input.identity == identity));
        same.map_or(Ok(()), |input| Err(OutputError::Input { path: output.into(), what: input.what.clone() }))
    }
}

/// What may be replaced where an output exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Replace {
    /// Nothing.
    Nothing,
    /// What begins like this: an earlier output of the same command.
    Like(&'static str),
    /// Anything that is a file.
    Anything,
}

impl Replace {
    /// Anything where `overwrite` says so, or else what begins like `own`.
    #[must_use]
    pub fn own(own: &'static str, overwrite: bool) -> Self {
        if overwrite { Self::Anything } else { Self::Like(own) }
    }

    /// Whether an output may be written now.
    ///
    /// # Errors
    /// It may not.
    pub fn allows(self, output: &Path) -> Result<(), OutputError> {
        let Ok(about) = fs::metadata(output) else { return Ok(()) };
        if !about.is_file() {
            return match unfit(about.file_type()) {
                Some(what) => Err(OutputError::NoFile { path: output.into(), what }),
                None => Ok(()),
            };
        }
        if is_under_way(output) {
            return Err(OutputError::UnderWay(output.into()));
        }
        // Nothing is lost with an empty file, such as mktemp makes.
        if about.len() == 0 || self == Self::Anything || matches!(self, Self::Like(own) if begins(output, own)) {
            return Ok(());
        }
        Err(OutputError::Exists(output.into()))
    }
}

/// What is no file and cannot be written like one; pipes and character devices can.
fn unfit(kind: FileType) -> Option<&'static str> {
    if kind.is_dir() {
        Some("a folder")
    } else if kind.is_socket() {
        Some("a socket")
    } else if kind.is_block_device() {
        Some("a block device")
    } else {
        None
    }
}

/// Whether a program holds the file locked, as recorders do.
fn is_under_way(path: &Path) -> bool {
    File::open(path).is_ok_and(|file| matches!(file.try_lock_shared(), Err(fs::TryLockError::WouldBlock)))
}

fn begins(path: &Path, with: &str) -> bool {
    let mut head = vec![0; with.len()];
    File::open(path).and_then(|mut file| file.read_exact(&mut head)).is_ok() && head == with.as_bytes()
}

/// A file that has another name until it is put in place, and is gone where it never was.
#[derive(Debug)]
pub struct Draft {
    file: File,
    part: PathBuf,
    placed: bool,
}

impl Draft {
    /// An empty one in the folder of `target`, locked for as long as it, or a clone of its handle, is open.
    ///
    /// # Errors
    /// The folder takes no file.
    pub fn beside(target: &Path) -> Result<Self, OutputError> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        let target = through_links(target);
        loop {
            let number = COUNT.fetch_add(1, Ordering::Relaxed);
            let part = folder_of(&target).join(format!("{}{}-{number}{}", PART[0], std::process::id(), PART[1]));
            let file = match OpenOptions::new().write(true).create_new(true).open(&part) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
                opened => opened.map_err(OutputError::io(&target))?,
            };
            // Where a file system knows no locks, whoever sweeps finds none to be had either.
            let locked = file.lock().is_ok();
            let draft = Self { file, part, placed: false };
            // Between its making and its lock it may have been swept away.
            if !locked || draft.file.metadata().is_ok_and(|about| about.nlink() > 0) {
                return Ok(draft);
            }
        }
    }

    /// Another handle on the file.
    ///
    /// # Errors
    /// The system gives none.
    pub fn handle(&self) -> Result<File, OutputError> {
        self.file.try_clone().map_err(OutputError::io(&self.part))
    }

    /// Gives it its name, which nobody else may have taken unless that may be replaced.
    ///
    /// # Errors
    /// The name is taken, or the system refuses.
    pub fn place(&mut self, target: &Path, replace: Replace) -> Result<(), OutputError> {
        let target = through_links(target);
        replace.allows(&target)?;
        if fs::metadata(&target).is_ok_and(|about| !about.is_file()) {
            return Err(OutputError::Exists(target));
        }
        let taken = |error: &io::Error| error.kind() == ErrorKind::AlreadyExists;
        let claimed = match fs::hard_link(&self.part, &target) {
            // A file system without such links: an empty file takes the name.
            Err(error) if !taken(&error) => {
                OpenOptions::new().write(true).create_new(true).open(&target).map(|_| false)
            }
            linked => linked.map(|()| true),
        };
        match claimed {
            // The second name is swept away later where it cannot be removed now.
            Ok(true) => drop(fs::remove_file(&self.part)),
            Ok(false) => fs::rename(&self.part, &target).map_err(OutputError::io(&target))?,
            // Somebody was faster.
            Err(error) if taken(&error) && replace.allows(&target).is_err() => return Err(OutputError::Exists(target)),
            Err(error) if taken(&error) => fs::rename(&self.part, &target).map_err(OutputError::io(&target))?,
            Err(error) => return Err(OutputError::io(&target)(error)),
        }
        self.placed = true;
        Ok(())
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.placed {
            // Swept away later where it cannot be removed now.
            let _ = fs::remove_file(&self.part);
        }
    }
}

/// A file being written: a draft until it is whole, or a stream such as a pipe, which takes it as it comes.
#[derive(Debug)]
pub struct Output {
    file: File,
    draft: Option<Draft>,
    target: PathBuf,
    replace: Replace,
}

impl Output {
    /// An empty one.
    ///
    /// # Errors
    /// What is there may not be replaced, or the system refuses.
    pub fn create(target: &Path, replace: Replace) -> Result<Self, OutputError> {
        replace.allows(target)?;
        let (file, draft) = if is_stream(target) {
            (OpenOptions::new().write(true).open(target).map_err(OutputError::io(target))?, None)
        } else {
            let draft = Draft::beside(target)?;
            (draft.handle()?, Some(draft))
        };
        Ok(Self { file, draft, target: target.into(), replace })
    }

    /// Puts it in its place, whole.
    ///
    /// # Errors
    /// Somebody has taken the name, or the system refuses.
    pub fn place(mut self) -> Result<(), OutputError> {
        self.draft.as_mut().map_or(Ok(()), |draft| draft.place(&self.target, self.replace))
    }
}

impl io::Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// Writes a whole file, or leaves what was there.
///
/// # Errors
/// What is there may not be replaced, or the system refuses.
pub fn write(target: &Path, replace: Replace, contents: &[u8]) -> Result<(), OutputError> {
    let mut output = Output::create(target, replace)?;
    output.write_all(contents).map_err(OutputError::io(target))?;
    output.place()
}

/// Whether a target is written as it is opened: a pipe, a terminal, what `/dev/stdout` stands for.
#[must_use]
pub fn is_stream(target: &Path) -> bool {
    let stream = fs::metadata(target).is_ok_and(|about| !about.is_file() && unfit(about.file_type()).is_none());
    stream || ["/dev/fd", "/dev/stdout", "/dev/stderr", "/proc"].iter().any(|system| target.starts_with(system))
}

/// Removes the drafts that killed processes have left in the folder of `target`: nobody holds their lock.
pub fn sweep(target: &Path) {
    // What cannot be looked at or removed is left to whoever can.
    let Ok(entries) = fs::read_dir(folder_of(&through_links(target))) else { return };
    for entry in entries.filter_map(Result::ok) {
        let name = entry.file_name();
        let is_draft = name.to_str().is_some_and(|name| name.starts_with(PART[0]) && name.ends_with(PART[1]));
        if is_draft && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(entry.path());
        }
    }
}

fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Where symbolic links lead, to a file that may not be there yet.
fn through_links(target: &Path) -> PathBuf {
    let mut target = target.to_owned();
    for _ in 0..LINKS {
        let Ok(next) = fs::read_link(&target) else { break };
        target = folder_of(&target).join(next);
    }
    target
}

#[cfg(test)]
mod tests {
    use std::os::unix::fs::symlink;

    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let mut names: Vec<_> =
            fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    #[test]
    fn an_input_is_spared_by_whatever_name_it_is_called() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("read"), "x").unwrap();
        fs::write(path("other"), "x").unwrap();
        symlink("read", path("soft")).unwrap();
        fs::hard_link(path("read"), path("hard")).unwrap();
        let inputs = Inputs::new().with("the scene", &path("read")).with("nothing", &path("absent"));
        for name in ["read", "soft", "hard", "./read"] {
            let message = inputs.spare(&path(name)).unwrap_err().to_string();
            assert!(message.contains("is the scene, which this command reads"), "{message}");
        }
        inputs.spare(&path("other")).unwrap();
        inputs.spare(&path("new")).unwrap();
        // The null device may be both.
        Inputs::new().with("nothing", Path::new("/dev/null")).spare(Path::new("/dev/null")).unwrap();
    }

    #[test]
    fn a_draft_has_its_name_only_when_it_is_whole_and_takes_nobodys() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let mut first = Output::create(&path("out"), Replace::Nothing).unwrap();
        let mut second = Output::create(&path("out"), Replace::Nothing).unwrap();
        first.write_all(b"first").unwrap();
        second.write_all(b"second").unwrap();
        assert!(!path("out").exists());
        first.place().unwrap();
        assert!(matches!(second.place(), Err(OutputError::Exists(_))));
        assert_eq!(fs::read(path("out")).unwrap(), b"first");
        assert!(matches!(Output::create(&path("out"), Replace::Nothing), Err(OutputError::Exists(_))));
        assert!(matches!(Output::create(&path("out"), Replace::Like("sec")), Err(OutputError::Exists(_))));
        write(&path("out"), Replace::Like("fir"), b"third").unwrap();
        write(&path("out"), Replace::Anything, b"fourth").unwrap();
        assert_eq!((names(folder.path()), fs::read(path("out")).unwrap()), (vec!["out".into()], b"fourth".into()));
        // As mktemp makes them.
        fs::write(path("empty"), "").unwrap();
        write(&path("empty"), Replace::Nothing, b"now").unwrap();
        assert!(matches!(write(folder.path(), Replace::Anything, b""), Err(OutputError::NoFile { .. })));
        write(Path::new("/dev/null"), Replace::Nothing, b"gone").unwrap();
    }

    #[test]
    fn links_stay_and_lead_to_what_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::create_dir(path("deep")).unwrap();
        symlink("deep/real", path("link")).unwrap();
        write(&path("link"), Replace::Nothing, b"one").unwrap();
        write(&path("link"), Replace::Anything, b"two").unwrap();
        assert!(fs::symlink_metadata(path("link")).unwrap().is_symlink());
        assert_eq!(fs::read(path("deep/real")).unwrap(), b"two");
    }

    #[test]
    fn what_the_dead_left_is_swept_away_and_what_is_being_written_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path(".stagger-1-0.part"), "dead").unwrap();
        fs::write(path(".stagger.part"), "somebody's").unwrap();
        let draft = Draft::beside(&path("out")).unwrap();
        let handle = draft.handle().unwrap();
        sweep(&path("out"));
        assert_eq!(names(folder.path()).len(), 2, "{:?}", names(folder.path()));
        let mut draft = draft;
        draft.place(&path("out"), Replace::Nothing).unwrap();
        drop((draft, handle));
        assert_eq!(names(folder.path()), [".stagger.part", "out"]);
    }

    #[test]
    fn what_is_being_written_is_not_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let target = folder.path().join("out");
        let mut draft = Draft::beside(&target).unwrap();
        draft.handle().unwrap().write_all(b"growing").unwrap();
        draft.place(&target, Replace::Nothing).unwrap();
        assert!(matches!(Replace::Anything.allows(&target), Err(OutputError::UnderWay(_))));
        drop(draft);
        Replace::Anything.allows(&target).unwrap();
    }
}
