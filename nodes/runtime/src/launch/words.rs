//! Words as a shell takes them: split from one text, as `--node NODE=COMMAND` takes it, and quoted for one.

use std::borrow::Cow;

/// Splits a text as a POSIX shell would, with its quotes and backslashes; nothing is expanded.
///
/// # Errors
/// A quote that does not end, a backslash at the end, or no word at all; the text says which.
pub fn split(text: &str) -> Result<Vec<String>, String> {
    let words = shlex::split(text).ok_or("a quote has no end, or a backslash at its end escapes nothing")?;
    if words.first().is_none_or(String::is_empty) {
        return Err("expected a program and its arguments, such as python3 mine.py".into());
    }
    Ok(words)
}

/// A word as it is typed in a shell: in quotes where it has more than letters, digits and what no shell reads otherwise.
pub fn quote(word: &str) -> String {
    // `shlex` quotes `=`, too, which no shell reads otherwise behind the first letters of an argument.
    let plain =
        !word.is_empty() && word.chars().all(|letter| letter.is_ascii_alphanumeric() || "._-+=".contains(letter));
    if plain {
        return word.to_owned();
    }
    // It refuses nothing else than the sign that is allowed here.
    shlex::Quoter::new().allow_nul(true).quote(word).map_or_else(|_| word.to_owned(), Cow::into_owned)
}

#[cfg(test)]
mod tests {
    use super::{quote, split};

    #[test]
    fn words_are_those_of_a_shell() {
        for (text, words) in [
            ("python3  mine.py", &["python3", "mine.py"][..]),
            ("python3 'my folder/mine.py' --x=\"a b\"c", &["python3", "my folder/mine.py", "--x=a bc"]),
            (r#"a\ b "say \"no\" \n" '\' """#, &["a b", r#"say "no" \n"#, r"\", ""]),
        ] {
            assert_eq!(split(text).unwrap(), words);
        }
    }

    #[test]
    fn what_is_no_command_is_told() {
        for (text, message) in
            [("sh 'a", "a quote has no end"), ("sh a\\", "backslash"), ("  ", "a program"), ("''", "a program")]
        {
            assert!(split(text).unwrap_err().contains(message), "{text}");
        }
    }

    #[test]
    fn what_is_quoted_is_one_word_again() {
        assert_eq!((quote("none"), quote("a=1e-6")), ("none".into(), "a=1e-6".into()));
        for word in ["{ emissivity = 0.3 }", "it's", "'", "a\\b", "\"x\" y", "$(ls);*"] {
            assert_eq!(split(&quote(word)).unwrap(), [word]);
        }
    }
}
