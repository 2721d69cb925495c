//! The page of `txt panel` in a headless Chromium. Each test has a panel and a browser of its own.

mod axe;
mod driver;
mod driving;
mod lesson;
mod looks;
mod loss;
mod machine;
mod others;
mod page;
mod picture;
mod plot;
mod stop;
mod txt;
