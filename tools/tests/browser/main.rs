//! The page of `txt panel` in a headless Chromium. Each test has a panel and a browser of its own.

mod driver;
mod driving;
mod machine;
mod page;
mod picture;
#[allow(dead_code, reason = "other tests use all of it")]
#[path = "../running/mod.rs"]
mod running;
mod stop;
mod txt;
