//! How many numbers at a time the contact and stress kernels compute.
//!
//! By default as many as the processor takes. Every width gives the same bits; it can be set so that this can be tested, and so
//! that a processor's wider registers can be ruled out as the cause of anything.

use std::sync::OnceLock;

use pulp::Arch;

/// The width of this process: found or set once.
static CHOSEN: OnceLock<Arch> = OnceLock::new();

/// Why a width cannot be set.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum WidthError {
    /// There is none of that name for this processor.
    #[error("there is no width `{name}` here: expected {}", available().join(" or "))]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// Something has been computed with another one, or it was set before.
    #[error("the width `{name}` comes too late: this process computes with another one already")]
    Late {
        /// What was asked for.
        name: String,
    },
}

/// Names of the widths that this processor has, the narrowest first: `scalar`, then `avx2` and `avx512` or `neon`.
#[must_use]
pub fn available() -> Vec<&'static str> {
    all().into_iter().map(|(name, _)| name).collect()
}

fn all() -> Vec<(&'static str, Arch)> {
    let mut all = vec![("scalar", Arch::Scalar)];
    #[cfg(target_arch = "x86_64")]
    {
        all.extend(pulp::x86::V3::try_new().map(|simd| ("avx2", Arch::V3(simd))));
        all.extend(pulp::x86::V4::try_new().map(|simd| ("avx512", Arch::V4(simd))));
    }
    #[cfg(target_arch = "aarch64")]
    all.extend(pulp::aarch64::Neon::try_new().map(|simd| ("neon", Arch::Neon(simd))));
    all
}

/// Computes with the width of this name from now on; to be called before anything is computed.
///
/// # Errors
/// The processor has no such width, or it is too late.
pub fn set(name: &str) -> Result<(), WidthError> {
    let found = all().into_iter().find(|(known, _)| *known == name);
    let (_, arch) = found.ok_or_else(|| WidthError::Unknown { name: name.into() })?;
    CHOSEN.set(arch).map_err(|_| WidthError::Late { name: name.into() })
}

/// The width of this process.
pub(crate) fn chosen() -> Arch {
    *CHOSEN.get_or_init(Arch::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One process has one width: this is the only test that sets it, to what it would be anyway.
    #[test]
    fn a_width_is_set_once_and_by_a_known_name() {
        let unknown = set("avx3").unwrap_err();
        assert!(unknown.to_string().contains("`avx3`") && unknown.to_string().contains("scalar"), "{unknown}");
        let widest = available().pop().unwrap();
        let _ = set(widest);
        assert_eq!(set(widest), Err(WidthError::Late { name: widest.into() }));
        assert_eq!(format!("{:?}", chosen()), format!("{:?}", Arch::new()));
    }
}
