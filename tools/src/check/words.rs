//! Texts in both languages.

use std::borrow::Cow;

use clap::ValueEnum;

/// The languages of lessons and their checks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Language {
    /// English
    En,
    /// Deutsch
    De,
}

impl Language {
    /// German where the system speaks it, otherwise English.
    pub(super) fn of_system() -> Self {
        match sys_locale::get_locale() {
            Some(locale) if locale.to_lowercase().starts_with("de") => Self::De,
            _ => Self::En,
        }
    }
}

/// A number as it is written in German.
pub(super) fn german(number: f64, decimals: usize) -> String {
    format!("{number:.decimals$}").replace('.', ",")
}

/// A text in each language.
#[derive(Clone, Debug)]
pub(super) struct Words {
    en: Cow<'static, str>,
    de: Cow<'static, str>,
}

impl Words {
    pub(super) const fn fixed(en: &'static str, de: &'static str) -> Self {
        Self { en: Cow::Borrowed(en), de: Cow::Borrowed(de) }
    }

    pub(super) fn new(en: impl Into<Cow<'static, str>>, de: impl Into<Cow<'static, str>>) -> Self {
        Self { en: en.into(), de: de.into() }
    }

    pub(super) fn text(&self, language: Language) -> &str {
        match language {
            Language::En => &self.en,
            Language::De => &self.de,
        }
    }
}

/// What is still wrong, and what may help.
#[derive(Clone, Debug)]
pub(super) struct Wrong {
    what: Words,
    hint: Option<Words>,
}

impl Wrong {
    pub(super) fn new(en: impl Into<Cow<'static, str>>, de: impl Into<Cow<'static, str>>) -> Self {
        Self { what: Words::new(en, de), hint: None }
    }

    /// Adds what may help.
    pub(super) fn hint(mut self, en: &'static str, de: &'static str) -> Self {
        self.hint = Some(Words::fixed(en, de));
        self
    }

    pub(super) fn text(&self, language: Language) -> String {
        let what = self.what.text(language);
        let Some(hint) = &self.hint else { return what.to_owned() };
        let begin = match language {
            Language::En => "Hint",
            Language::De => "Tipp",
        };
        format!("{what}\n{begin}: {}", hint.text(language))
    }
}

/// The result of a check or of a part of it.
pub(super) type Check<T = ()> = Result<T, Wrong>;
