//! What a physics contributes to pictures of a run: the quantities that colour first.

/// A quantity that a picture of a run shows without being asked. Fields that no built-in physics writes are shown, too; what
/// a built-in physics writes beside these is not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pictured {
    /// Its field; of a field with three components the norm is shown.
    pub field: &'static str,
    /// What a legend calls it.
    pub name: &'static str,
    /// Title of its curves over time.
    pub title: &'static str,
    /// Whether it has a picture beside that of its support, or colours that one. Of several that colour one picture, that of
    /// the physics with the highest rank does.
    pub beside: bool,
    /// Whether its values spread over decades, and colours follow their logarithm.
    pub decades: bool,
    /// Whether a run is about the time in which it is not small: where it is over before the end, that time is shown again and
    /// again.
    pub passing: bool,
}

impl Pictured {
    /// A quantity that colours the picture of its support, evenly.
    #[must_use]
    pub const fn new(field: &'static str, name: &'static str, title: &'static str) -> Self {
        Self { field, name, title, beside: false, decades: false, passing: false }
    }
}
