//! Files a scene names: read by whoever parses the scene, as nothing here does I/O; their contents are part of it.

use std::{cell::RefCell, collections::BTreeMap, sync::Arc};

/// Contents of the files a scene names, by their paths as the scene writes them.
pub type Files = BTreeMap<String, Arc<[u8]>>;

/// Reads the file at a path that a scene names; what went wrong is said in words.
pub type ReadFile<'r> = &'r dyn Fn(&str) -> Result<Vec<u8>, String>;

/// What `stagger_scene::Scene::parse` reads files with: it has none.
pub fn none(_: &str) -> Result<Vec<u8>, String> {
    Err("this scene is read without the files it names (Scene::parse_with_files takes them)".into())
}

/// Reads each file once.
pub struct Reader<'r> {
    read: ReadFile<'r>,
    files: RefCell<Files>,
}

impl<'r> Reader<'r> {
    /// What `read` finds, each file once.
    pub fn new(read: ReadFile<'r>) -> Self {
        Self { read, files: RefCell::default() }
    }

    /// The contents of a file.
    pub fn contents(&self, path: &str) -> Result<Arc<[u8]>, String> {
        if let Some(contents) = self.files.borrow().get(path) {
            return Ok(Arc::clone(contents));
        }
        let contents: Arc<[u8]> = (self.read)(path)?.into();
        self.files.borrow_mut().insert(path.into(), Arc::clone(&contents));
        Ok(contents)
    }

    /// The files read.
    pub fn take(&self) -> Files {
        self.files.take()
    }
}
