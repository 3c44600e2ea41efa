//! The physics against closed forms and published figures: one file for each, every tolerance argued where it stands.

#[cfg(test)]
mod heat;
#[cfg(test)]
mod light;
