//! Key expressions of a run: `stagger/<run>/…`. Names of runs, nodes and fields hold letters, digits, `-` and `_`.

use crate::MessageError;

/// Everything of one run.
#[must_use]
pub fn all(run: &str) -> String {
    format!("stagger/{run}/**")
}

/// The values of one field: payload raw values, attachment [`crate::FieldMessage`] without them.
#[must_use]
pub fn field(run: &str, node: &str, field: &str) -> String {
    format!("stagger/{run}/field/{node}/{field}")
}

/// What the coordinator says to all nodes: [`crate::Directive`].
#[must_use]
pub fn directive(run: &str) -> String {
    format!("stagger/{run}/ctl/directive")
}

/// What a node says to the coordinator: [`crate::Report`].
#[must_use]
pub fn report(run: &str, node: &str) -> String {
    format!("stagger/{run}/done/{node}")
}

/// Reports of all nodes.
#[must_use]
pub fn reports(run: &str) -> String {
    format!("stagger/{run}/done/*")
}

/// What a node holds at a checkpoint: [`crate::Snapshot`].
#[must_use]
pub fn snapshot(run: &str, node: &str) -> String {
    format!("stagger/{run}/snapshot/{node}")
}

/// Where the coordinator answers with the [`crate::Snapshot`] a node is to go on from.
#[must_use]
pub fn restore(run: &str, node: &str) -> String {
    format!("stagger/{run}/restore/{node}")
}

/// A whole [`crate::Checkpoint`], for the recording.
#[must_use]
pub fn checkpoint(run: &str) -> String {
    format!("stagger/{run}/checkpoint")
}

/// Where a node answers with its [`crate::Manifest`].
#[must_use]
pub fn manifest(run: &str, node: &str) -> String {
    format!("stagger/{run}/meta/{node}")
}

/// Liveliness token of one process of a node.
#[must_use]
pub fn live(run: &str, node: &str, instance: &str) -> String {
    format!("stagger/{run}/live/{node}/{instance}")
}

/// Liveliness tokens of all nodes.
#[must_use]
pub fn live_all(run: &str) -> String {
    format!("stagger/{run}/live/*/*")
}

/// The part of a key behind `stagger/<run>/`, which is also the topic in a recording.
#[must_use]
pub fn topic(key: &str) -> &str {
    key.splitn(3, '/').nth(2).unwrap_or(key)
}

/// The node and the instance of a liveliness key.
#[must_use]
pub fn parse_live(key: &str) -> Option<(&str, &str)> {
    topic(key).strip_prefix("live/")?.split_once('/')
}

/// Checks a name of a run, node or field.
///
/// # Errors
/// The name is empty or holds a character that means something in a key expression.
pub fn check_name(name: &str) -> Result<&str, MessageError> {
    let fits = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.is_empty() && name.chars().all(fits) { Ok(name) } else { Err(MessageError::Name(name.into())) }
}

#[cfg(test)]
mod tests {
    #[test]
    fn topics_drop_the_run_and_names_stay_out_of_the_key_syntax() {
        assert_eq!(super::topic(&super::field("r1", "thermal", "temperature")), "field/thermal/temperature");
        assert_eq!(super::parse_live(&super::live("r1", "thermal", "77")), Some(("thermal", "77")));
        assert!(super::check_name("a/b").is_err() && super::check_name("*").is_err() && super::check_name("").is_err());
        assert!(super::check_name("electric-deposition_1").is_ok());
    }
}
