//! Where the processes of a run on one host meet: a socket in a folder of the run's own, which goes with the run.
//!
//! The name of a socket is short, 107 bytes on Linux. Where the temporary directory's is too long for it, another one is used;
//! whoever looks for a run looks in all of them.

use std::{
    fs::{self, DirBuilder, File},
    io::ErrorKind,
    os::unix::{
        fs::{DirBuilderExt as _, MetadataExt as _},
        net::UnixStream,
    },
    path::{Path, PathBuf},
};

use stagger_messages::codec;
use stagger_recordings::{Recorder, RecorderOptions, RecordingError, RunInfo};
use stagger_scene::Scene;

use crate::diagnostics;

/// The longest path of a socket, in bytes: what `sockaddr_un` holds on all systems, with its end (unix(7)).
const PATH_BYTES: usize = if cfg!(target_os = "linux") { 107 } else { 103 };
/// The socket, and what Zenoh locks beside it.
const SOCKET: &str = "hub.sock";
const LOCK: &str = "hub.sock.lock";
/// The scene and the files it names, where no other process can read them where they came from.
const SCENE: &str = "scene.toml";
const FILES: &str = "scene.mcap";
/// What names of folders begin with.
const PREFIX: &str = "stagger-";

/// Why there is no endpoint.
#[derive(Debug, thiserror::Error)]
pub enum EndpointError {
    /// The folder cannot be made.
    #[error("cannot make {}: {source}\nhint: TMPDIR names the folder for it", .folder.display())]
    Folder {
        /// Its path.
        folder: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// No temporary directory has a name that leaves room for a socket's.
    #[error(
        "no folder has a name short enough for a socket's, which may have {PATH_BYTES} bytes: tried {tried}\n\
         hint: set TMPDIR to a folder with a short name of plain letters"
    )]
    NoRoom {
        /// The folders.
        tried: String,
    },
    /// The scene cannot be left for the nodes.
    #[error("cannot leave the scene for the nodes in {}: {why}", .folder.display())]
    Scene {
        /// Where.
        folder: PathBuf,
        /// Why.
        why: String,
    },
}

/// Where a run is met.
#[derive(Debug)]
pub struct Endpoint {
    /// Its name, as Zenoh and `--connect` take it.
    pub name: String,
    place: Option<Place>,
}

#[derive(Debug)]
struct Place {
    folder: PathBuf,
    /// A lock on the folder, which says that its run lives; cleaners of temporary directories heed it, too.
    lock: File,
    /// The socket itself, whatever becomes of its name.
    socket: Option<File>,
    scene: Option<RunInfo>,
}

/// What nodes read instead of what cannot be read again.
#[derive(Clone, Debug)]
pub struct HandedOver {
    /// The scene.
    pub scene: PathBuf,
    /// A recording that holds the files it names, where it names some.
    pub files: Option<PathBuf>,
}

impl Endpoint {
    /// One that is not in a folder of this run: on another host, or as somebody else says.
    #[must_use]
    pub fn elsewhere(name: &str) -> Self {
        Self { name: name.into(), place: None }
    }

    /// A socket in a folder made for this run. Folders that killed runs have left are removed.
    ///
    /// # Errors
    /// The folder cannot be made, or no name is short enough.
    pub fn new(run: &str) -> Result<Self, EndpointError> {
        let Some(folder) = folders(run).into_iter().find(|folder| fits(folder)) else {
            let tried = roots().iter().map(|root| root.display().to_string()).collect::<Vec<_>>().join(", ");
            return Err(EndpointError::NoRoom { tried });
        };
        let lock = make(&folder).map_err(|source| EndpointError::Folder { folder: folder.clone(), source })?;
        if let (Ok(about), Some(root)) = (lock.metadata(), folder.parent()) {
            sweep(root, about.uid());
        }
        Ok(Self { name: socket(&folder), place: Some(Place { folder, lock, socket: None, scene: None }) })
    }

    /// Says that somebody listens on it now: from here on it can be mended.
    pub fn listened(&mut self) {
        if let Some(place) = &mut self.place {
            place.socket = hold(&place.folder.join(SOCKET));
        }
    }

    /// Leaves the scene of a run, and the files it names, for the nodes. `None` where the nodes are not on this host.
    ///
    /// # Errors
    /// They cannot be written.
    pub fn hand_over(&mut self, scene: &Scene) -> Result<Option<HandedOver>, EndpointError> {
        let Some(place) = &mut self.place else { return Ok(None) };
        place.scene = Some(RunInfo {
            scene_text: scene.text.clone(),
            files: scene.files.clone(),
            scene_hash: scene.hash,
            overrides: scene.overrides.clone(),
            ..RunInfo::default()
        });
        place.leave_scene()?;
        let files = (!scene.files.is_empty()).then(|| place.folder.join(FILES));
        Ok(Some(HandedOver { scene: place.folder.join(SCENE), files }))
    }

    /// Makes the folder again where somebody has removed it, so that nodes find their run.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn mend(&mut self) -> Result<(), EndpointError> {
        let Some(place) = &mut self.place else { return Ok(()) };
        let path = place.folder.join(SOCKET);
        let Some(number) = place.socket.as_ref().map(std::os::fd::AsRawFd::as_raw_fd) else { return Ok(()) };
        if path.symlink_metadata().is_ok() {
            return Ok(());
        }
        diagnostics::warn(&format!("{} was removed and is made again", place.folder.display()));
        let failed = |source| EndpointError::Folder { folder: place.folder.clone(), source };
        if !place.folder.is_dir() {
            place.lock = make(&place.folder).map_err(failed)?;
        }
        // The socket has lost its name, not its listener: the system knows it by the handle held here.
        let held = format!("/proc/{}/fd/{number}", std::process::id());
        std::os::unix::fs::symlink(held, &path).map_err(failed)?;
        place.leave_scene()
    }
}

impl Place {
    fn leave_scene(&self) -> Result<(), EndpointError> {
        let Some(info) = &self.scene else { return Ok(()) };
        let failed = |why: String| EndpointError::Scene { folder: self.folder.clone(), why };
        fs::write(self.folder.join(SCENE), &info.scene_text).map_err(|error| failed(error.to_string()))?;
        if info.files.is_empty() {
            return Ok(());
        }
        let files = File::create(self.folder.join(FILES)).map_err(RecordingError::Read);
        files
            .and_then(|file| Recorder::create(file, info, RecorderOptions::default())?.finish())
            .map(|_| ())
            .map_err(|error| failed(error.to_string()))
    }
}

impl Drop for Endpoint {
    fn drop(&mut self) {
        if let Some(place) = &self.place {
            // What is left behind is removed by a later run.
            let _ = fs::remove_dir_all(&place.folder);
        }
    }
}

/// The folder of a run on this host, where `view` finds its socket by the run's name.
#[must_use]
pub fn socket_folder(run: &str) -> PathBuf {
    let folders = folders(run);
    let there = folders.iter().find(|folder| folder.is_dir()).or(folders.first());
    there.cloned().unwrap_or_default()
}

/// The endpoint in a run's folder.
#[must_use]
pub fn socket(folder: &Path) -> String {
    format!("unixsock-stream/{}", folder.join(SOCKET).display())
}

/// Directories for what is temporary, the user's own first.
fn roots() -> Vec<PathBuf> {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let mut roots: Vec<PathBuf> = Vec::new();
    let usual = ["/tmp", "/var/tmp"].map(PathBuf::from);
    for root in set("TMPDIR").into_iter().chain(set("XDG_RUNTIME_DIR")).chain(usual) {
        let root = std::path::absolute(&root).unwrap_or(root);
        if !roots.contains(&root) {
            roots.push(root);
        }
    }
    // The usual one comes first where nothing is set.
    if set("TMPDIR").is_none()
        && let Some(at) = roots.iter().position(|root| root == Path::new("/tmp"))
    {
        roots[..=at].rotate_right(1);
    }
    roots
}

/// Where the folder of a run may be, in the order in which it is tried.
fn folders(run: &str) -> Vec<PathBuf> {
    let short = format!("{PREFIX}{:016x}", codec::hash(run.as_bytes()));
    roots().iter().flat_map(|root| [root.join(format!("{PREFIX}{run}")), root.join(&short)]).collect()
}

/// Whether the socket in a folder can be named to the system and to Zenoh, whose endpoints give `?` and `#` a meaning.
fn fits(folder: &Path) -> bool {
    let path = folder.join(SOCKET);
    path.as_os_str().len() <= PATH_BYTES && path.to_str().is_some_and(|path| !path.contains(['?', '#', ';']))
}

/// A folder for this user alone, and the lock on it.
fn make(folder: &Path) -> std::io::Result<File> {
    loop {
        match DirBuilder::new().mode(0o700).create(folder) {
            // A process of the same number was killed.
            Err(error) if error.kind() == ErrorKind::AlreadyExists && is_left(folder) == Some(true) => {
                remove(folder)?;
                continue;
            }
            made => made?,
        }
        let lock = File::open(folder)?;
        // Not every file system knows locks; one who sweeps there finds none to be had either.
        let locked = lock.lock().is_ok();
        let here = || Some(fs::metadata(folder).ok()?.ino() == lock.metadata().ok()?.ino());
        // Between its making and its lock it may have been swept away.
        if !locked || here() == Some(true) {
            return Ok(lock);
        }
    }
}

/// Removes folders of runs whose processes are gone: nobody holds their lock, and nobody listens.
fn sweep(root: &Path, user: u32) {
    let Ok(entries) = fs::read_dir(root) else { return };
    for entry in entries.filter_map(Result::ok) {
        let (name, folder) = (entry.file_name(), entry.path());
        let own = entry.metadata().is_ok_and(|about| about.is_dir() && about.uid() == user);
        if own && name.to_str().is_some_and(|name| name.starts_with(PREFIX)) && is_left(&folder) == Some(true) {
            // What cannot be removed stays.
            let _ = remove(&folder);
        }
    }
}

/// Removes a folder and what a run leaves in it; one that holds anything else stays.
fn remove(folder: &Path) -> std::io::Result<()> {
    for file in [SCENE, FILES, SOCKET, LOCK] {
        // Not all of them are there.
        let _ = fs::remove_file(folder.join(file));
    }
    fs::remove_dir(folder)
}

/// Whether a folder holds what a run leaves, all of it and nothing else, and that run is gone.
fn is_left(folder: &Path) -> Option<bool> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder).ok()? {
        names.push(entry.ok()?.file_name().into_string().ok()?);
    }
    let ours = names.iter().all(|name| [SOCKET, LOCK, SCENE, FILES].contains(&name.as_str()));
    let a_run = names.iter().any(|name| name == SOCKET || name == LOCK);
    let nobody = || match UnixStream::connect(folder.join(SOCKET)) {
        Err(error) => [ErrorKind::ConnectionRefused, ErrorKind::NotFound].contains(&error.kind()),
        Ok(_) => false,
    };
    let unlocked = File::open(folder).ok()?.try_lock().is_ok();
    Some(ours && a_run && unlocked && nobody())
}

/// A handle on a socket's file, which keeps what its name loses.
#[cfg(target_os = "linux")]
fn hold(socket: &Path) -> Option<File> {
    use std::os::unix::fs::OpenOptionsExt as _;
    // A socket cannot be opened to be read; this only points at it (open(2)).
    File::options().read(true).custom_flags(nix::libc::O_PATH).open(socket).ok()
}

#[cfg(not(target_os = "linux"))]
fn hold(_socket: &Path) -> Option<File> {
    None
}
