//! What happened in a recorded run, as text.

use std::fmt::{self, Display, Formatter};

use stagger_coupling::{Account, math};
use stagger_messages::shown_name;

use crate::Summary;

impl Display for Summary {
    /// What `stagger info` prints.
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let outcome = match self.completed {
            Some(true) => "completed".to_owned(),
            Some(false) => format!("stopped: {}", self.reason),
            None if self.being_written => "it goes on".to_owned(),
            None => "not closed: the recording ends before its run did".to_owned(),
        };
        let file = match (&self.damage, self.complete) {
            (Some(damage), _) => damage,
            (None, true) => "whole",
            (None, false) if self.being_written => "still being written; everything up to now was read",
            (None, false) => "cut off; everything up to the cut was read",
        };
        writeln!(f, "{:<12}{}", "run", self.run)?;
        writeln!(f, "{:<12}{}", "scene", self.scene_file)?;
        writeln!(f, "{:<12}{}", "program", self.program)?;
        for (node, file) in &self.replayed {
            writeln!(f, "{:<12}{node}, from {file}", "replayed")?;
        }
        for (node, command) in &self.commands {
            writeln!(f, "{:<12}{node}, by {command}", "replaced")?;
        }
        writeln!(f, "{:<12}{outcome}", "outcome")?;
        writeln!(f, "{:<12}{file}", "file")?;
        let time = quantity(self.simulated_time_s, "s");
        writeln!(
            f,
            "{:<12}{time} simulated, {} steps accepted, {} rejected",
            "reached", self.steps_accepted, self.steps_rejected
        )?;
        let each = if self.steps_accepted == 0 {
            String::new()
        } else {
            format!(" ({:.2} per accepted step)", self.iterations as f64 / self.steps_accepted as f64)
        };
        writeln!(f, "{:<12}{}{each}", "iterations", self.iterations)?;
        if let Some(dt) = &self.dt {
            let [min, median, max] = [dt.min_s, dt.median_s, dt.max_s].map(|size| quantity(size, "s"));
            writeln!(f, "{:<12}min {min}, median {median}, max {max}", "dt")?;
            writeln!(f, "{:<12}{}  (logarithmic)", "dt history", sparkline(&self.dt_history_s))?;
        }
        if let Some(why) = &self.last_rejection {
            writeln!(f, "{:<12}last {}", "rejected", why.trim_end_matches([':', ' ']))?;
        }
        if let Some(rate) = self.contraction {
            writeln!(f, "{:<12}by {rate:.3} from one iteration to the next (mean)", "contracts")?;
        }
        if !self.sensitive.is_empty() {
            let times: Vec<_> = self.sensitive.iter().map(|(field, times)| format!("{field} {times}")).collect();
            writeln!(f, "{:<12}{} (times each was the most sensitive)", "dt set by", times.join(", "))?;
        }
        match (self.checkpoints.first(), self.checkpoints.last()) {
            (Some(first), Some(last)) => {
                let count = self.checkpoints.len();
                writeln!(f, "{:<12}{count}, from step {first} to step {last}", "checkpoints")?;
            }
            _ => writeln!(f, "{:<12}none", "checkpoints")?,
        }
        if self.restarts > 0 {
            writeln!(f, "{:<12}{} of nodes that died", "restarts", self.restarts)?;
        }
        self.nodes(f)?;
        self.errors(f)?;
        self.energies(f)?;
        self.supports(f)?;
        self.topics(f)?;
        if self.refused > 0 {
            writeln!(f, "\n{} messages were refused by the nodes", self.refused)?;
        }
        if let Some(lost) = self.lost.filter(|lost| *lost > 0) {
            writeln!(f, "\n{lost} messages were sent but not recorded")?;
        }
        if self.malformed > 0 {
            writeln!(f, "\n{} recorded messages do not decode", self.malformed)?;
        }
        Ok(())
    }
}

impl Summary {
    fn nodes(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let rows = self.nodes.iter().map(|(name, node)| {
            let counts = [node.solves, node.reused, node.failures].map(|count| count.to_string());
            let times = [quantity(node.solve_s, "s"), quantity(node.wait_s, "s")];
            [vec![name.clone()], counts.to_vec(), times.to_vec()].concat()
        });
        table(f, &["node", "solved", "reused", "failed", "solve time", "wait time"], rows.collect())?;
        for (name, node) in &self.nodes {
            if let Some(failure) = &node.last_failure {
                writeln!(f, "  {name} failed last: {failure}")?;
            }
        }
        Ok(())
    }

    fn errors(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let row = |(field, errors): (&String, &crate::FieldErrors)| {
            let rejected = self.rejected_by.get(field).unwrap_or(&0).to_string();
            let sizes = [errors.tolerance, errors.mean, errors.largest].map(|error| format!("{error:.1e}"));
            [vec![field.clone()], sizes.to_vec(), vec![rejected]].concat()
        };
        let rows = self.errors.iter().map(row).collect();
        table(f, &["error of", "tolerance", "mean", "largest", "attempts rejected"], rows)
    }

    fn energies(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let mut rows = Vec::new();
        for (node, Account { initial, stored: held, gained, lost, .. }) in
            self.nodes.iter().map(|(name, node)| (name, &node.ledger))
        {
            for (name, stored) in held {
                let start = initial.get(name).copied().unwrap_or(0.0);
                let amounts = format!("{} -> {}", quantity(start, "J"), quantity(*stored, "J"));
                rows.push(vec![node.clone(), name.clone(), "stored".into(), amounts]);
            }
            for (kind, map) in [("gained", gained), ("lost", lost)] {
                let line = |(name, joule): (&String, &f64)| {
                    vec![node.clone(), name.clone(), kind.into(), quantity(*joule, "J")]
                };
                rows.extend(map.iter().map(line));
            }
        }
        if rows.is_empty() {
            return Ok(());
        }
        table(f, &["energy of", "name", "kind", "amount"], rows)?;
        for (what, joule) in &self.on_the_way {
            writeln!(f, "  on the way of {what}: {}, given and not yet taken", quantity(*joule, "J"))?;
        }
        for (what, share) in &self.imbalance {
            writeln!(f, "  imbalance of {what}: {share:.1e} of the energy turned over")?;
        }
        Ok(())
    }

    fn supports(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let row = |(name, told): (&String, &stagger_messages::Told)| {
            let fields: Vec<_> = told.fields.iter().map(|name| shown_name(name)).collect();
            vec![shown_name(name).into_owned(), told.to_string(), fields.join(", ")]
        };
        table(f, &["support", "its rows", "fields"], self.supports.iter().map(row).collect())
    }

    fn topics(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let row = |(name, topic): (&String, &crate::TopicSummary)| {
            vec![name.clone(), topic.messages.to_string(), bytes(topic.bytes)]
        };
        table(f, &["topic", "messages", "size"], self.topics.iter().map(row).collect())
    }
}

/// A table with a line before it; the first column stands left, numbers stand right.
fn table(f: &mut Formatter<'_>, head: &[&str], rows: Vec<Vec<String>>) -> fmt::Result {
    if rows.is_empty() {
        return Ok(());
    }
    let head: Vec<String> = head.iter().map(|&title| title.to_owned()).collect();
    let width = |column: usize| rows.iter().chain([&head]).map(|row| row[column].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let numeric =
        |column: usize| rows.iter().all(|row| row[column].starts_with(|c: char| c.is_ascii_digit() || c == '-'));
    let right: Vec<bool> = (0..head.len()).map(numeric).collect();
    writeln!(f)?;
    for row in [&head].into_iter().chain(&rows) {
        let cell = |(column, text): (usize, &String)| {
            let width = widths[column];
            if right[column] { format!("{text:>width$}") } else { format!("{text:<width$}") }
        };
        let line: Vec<String> = row.iter().enumerate().map(cell).collect();
        writeln!(f, "{}", line.join("  ").trim_end())?;
    }
    Ok(())
}

/// Bars of eight heights, from the smallest to the largest value on a logarithmic scale; of positive values.
fn sparkline(values: &[f64]) -> String {
    const BARS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];
    let (low, high) =
        values.iter().fold((f64::INFINITY, 0.0f64), |(low, high), value| (low.min(*value), high.max(*value)));
    let range = math::ln(high / low);
    let bar = |value: &f64| {
        // Equal values have no range, and stand in the middle.
        let share = if range > 0.0 { math::ln(value / low) / range } else { 0.5 };
        BARS[((share * BARS.len() as f64) as usize).min(BARS.len() - 1)]
    };
    values.iter().map(bar).collect()
}

/// A quantity with four digits and the prefix that leaves one to three of them before the point.
fn quantity(value: f64, unit: &str) -> String {
    const PREFIXES: [(f64, &str); 9] = [
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "u"),
        (1e-9, "n"),
        (1e-12, "p"),
        (1e-15, "f"),
    ];
    let prefix = PREFIXES.iter().find(|(size, _)| value.abs() >= *size * 0.99995);
    match prefix {
        Some((size, prefix)) if value.is_finite() => format!("{:.3} {prefix}{unit}", value / size),
        _ if value == 0.0 => format!("0 {unit}"),
        _ => format!("{value:.3e} {unit}"),
    }
}

/// A number of bytes in decimal units.
fn bytes(count: u64) -> String {
    if count < 1000 { format!("{count} B") } else { quantity(count as f64, "B") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sparkline_spans_the_values_by_their_ratios() {
        assert_eq!(sparkline(&[1.0, 2.0, 4.0, 128.0]), "▁▂▃█");
        assert_eq!(sparkline(&[3.0, 3.0]), "▅▅");
        assert_eq!(sparkline(&[]), "");
    }

    #[test]
    fn quantities_carry_the_prefix_that_reads_best() {
        assert_eq!(quantity(0.02, "s"), "20.000 ms");
        assert_eq!(quantity(-1.5e-7, "J"), "-150.000 nJ");
        assert_eq!(quantity(0.0, "J"), "0 J");
        assert_eq!(quantity(2e-20, "J"), "2.000e-20 J");
        assert_eq!(quantity(1e-6, "s"), "1.000 us");
        assert_eq!(bytes(999), "999 B");
        assert_eq!(bytes(2_500_000), "2.500 MB");
    }
}
