//! The section about fields: their share of the recording, and what they hold at the end.

use stagger_messages::Field;
use stagger_runtime::run::summary;

use super::{
    gathered::Gathered,
    html::{data, plots, table},
    plot::{Axis, Bar, Bars, Distribution, count, escape, histogram, quantity},
};

/// Bars at most; the smallest topics are put together.
const BARS: usize = 40;
/// Histograms at most.
const HISTOGRAMS: usize = 48;
/// Components that are told apart; of more, the length of the row is shown.
const COMPONENTS: [&str; 3] = ["x", "y", "z"];
/// Fewer rows are told by the table.
const FEWEST: usize = 6;
/// More components are no quantity of a point but a list, such as the path of a ray.
const LIST: usize = 9;

/// Bytes by topic, the last values in numbers, and how they are distributed.
pub fn fields(gathered: &Gathered) -> String {
    let mut text = bytes(gathered);
    let rows = gathered.fields.iter().map(|(name, field)| {
        let summary = summary::of_field(field);
        let value =
            |what: &str, value: f64| data(&format!("fields.{name}.{what}"), value, &quantity(value, &field.port.unit));
        let rows = data(&format!("fields.{name}.rows"), summary.rows, &count(summary.rows));
        let range = [value("min", summary.min), value("mean", summary.mean), value("max", summary.max)];
        [vec![escape(name), escape(&field.port.support), rows, field.components().to_string()], range.into()].concat()
    });
    let rows: Vec<_> = rows.collect();
    if !rows.is_empty() {
        text += "<p>At the end:</p>\n";
        text += &table(&["field", "on", "rows", "components", "min", "mean", "max"], 2, &rows);
    }
    let figures: Vec<_> = gathered.fields.iter().filter_map(|(name, field)| distribution(name, field)).collect();
    text += &plots(&figures[..figures.len().min(HISTOGRAMS)]);
    if figures.len() > HISTOGRAMS {
        text += &format!("<p class=\"faint\">The first {HISTOGRAMS} of {} fields.</p>\n", figures.len());
    }
    text
}

fn bytes(gathered: &Gathered) -> String {
    let of_field = |(topic, [messages, bytes]): (&String, &[u64; 2])| {
        topic.strip_prefix("field/").map(|name| (name.to_owned(), topic.clone(), *messages, *bytes))
    };
    let mut topics: Vec<_> = gathered.topics.iter().filter_map(of_field).collect();
    if topics.is_empty() {
        return String::new();
    }
    topics.sort_by_key(|(.., bytes)| std::cmp::Reverse(*bytes));
    let mut bars: Vec<Bar> =
        topics.iter().map(|(name, .., bytes)| Bar { name: name.clone(), values: vec![*bytes as f64] }).collect();
    if bars.len() > BARS {
        let rest = bars.split_off(BARS - 1);
        let sum = rest.iter().flat_map(|bar| &bar.values).sum();
        bars.push(Bar { name: format!("{} others", rest.len()), values: vec![sum] });
    }
    let bars = Bars {
        title: "Bytes recorded of each field".into(),
        axis: Axis::linear("bytes", "B"),
        parts: Vec::new(),
        bars,
    };
    let row = |(name, topic, messages, bytes): &(String, String, u64, u64)| {
        let key = |what: &str| format!("topics.{topic}.{what}");
        vec![
            escape(name),
            data(&key("messages"), messages, &count(*messages)),
            data(&key("bytes"), bytes, &quantity(*bytes as f64, "B")),
        ]
    };
    let rows: Vec<_> = topics.iter().map(row).collect();
    plots(&[bars.figure(), format!("<div>{}</div>\n", table(&["field", "messages", "bytes"], 1, &rows))])
}

/// How the values of a field are distributed; `None` for indices, lists and few rows.
fn distribution(name: &str, field: &Field) -> Option<String> {
    let values: Vec<f64> = match (field.f64(), field.u8()) {
        (Ok(values), _) => values.to_vec(),
        (_, Ok(values)) => values.iter().map(|value| f64::from(*value)).collect(),
        _ => return None,
    };
    let components = field.components();
    if field.rows() < FEWEST || components > LIST {
        return None;
    }
    let title = name.replace('_', " ");
    let column = |component: usize| values.iter().skip(component).step_by(components).copied().collect::<Vec<_>>();
    let (title, distributions) = match components {
        0 => return None,
        1 => (title, vec![Distribution::of("", &values, &values)]),
        2 | 3 => {
            let of = |component: usize| Distribution::of(COMPONENTS[component], &column(component), &values);
            (title, (0..components).map(of).collect())
        }
        _ => {
            let norms: Vec<f64> = values
                .chunks(components)
                .map(|row| row.iter().map(|value| value * value).sum::<f64>().sqrt())
                .collect();
            (format!("{title}, length of its {components} components"), vec![Distribution::of("", &norms, &norms)])
        }
    };
    Some(histogram(&title, &Axis::linear(&name.replace('_', " "), &field.port.unit), &distributions))
}
