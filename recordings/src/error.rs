//! What can go wrong when a run is recorded or a recording is read.

use std::path::PathBuf;

/// What can go wrong when a run is recorded or a recording is read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// A file cannot be opened.
    #[error("cannot open the recording {}: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The input is no MCAP.
    #[error(
        "this is not an MCAP recording: it does not begin with the MCAP signature; give the file that `run --record` wrote"
    )]
    NotMcap,
    /// The input holds no word about the run it records.
    #[error("the recording says nothing about its run: {0}")]
    NoRun(&'static str),
    /// A part of the run's description does not parse.
    #[error("the recording's description of its run is damaged: `{key}` is `{value}`")]
    BadRun {
        /// Key in the metadata.
        key: String,
        /// Its value.
        value: String,
    },
    /// The input is damaged, or packed in a way that cannot be read here.
    #[error("the recording cannot be read further: {0}; what precedes this point is sound")]
    Damaged(String),
    /// Reading failed.
    #[error("cannot read the recording: {0}")]
    Read(std::io::Error),
    /// A recorded message is not what its channel says.
    #[error("message on `{topic}` in the recording: {source}")]
    Message {
        /// The channel's topic.
        topic: String,
        /// What is wrong with it.
        source: stagger_messages::MessageError,
    },
    /// Writing failed; nothing is recorded any more.
    #[error("cannot write the recording: {0}; what was flushed before can be read")]
    Write(String),
    /// The recorder's thread cannot be started.
    #[error("cannot start the recorder's thread: {0}")]
    Thread(std::io::Error),
    /// Something was pushed after the recorder had finished.
    #[error("the recording is closed already")]
    Closed,
}
