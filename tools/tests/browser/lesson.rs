//! The page of a lesson: a pupil's way from the task to the next lesson, on a laptop and on a phone.

use std::fs;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::Arc;
use std::thread;

use anyhow::{ensure, Result};
use serde_json::json;

use super::driver::browse;
use super::page::{Lesson, Page};
use crate::classroom::{link_in, with_class};
use crate::lesson::lamp;

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn a_pupil_is_led_from_the_task_to_the_next_lesson() -> Result<()> {
    browse(|client| async move {
        let lesson = Lesson::start()?;
        let page = Page { client: client.clone() };
        client.goto(&lesson.url).await?;
        page.wait_for_text("#task h1", "Lesson 1").await?;
        page.wait_for(".machine .world").await?;
        page.wait_for_text(".values", "C1 0").await?;
        for width in [1366, 390] {
            page.resize(width, 844).await?;
            let surplus = "return document.documentElement.scrollWidth - innerWidth";
            let surplus = page.run(surplus, json!(null)).await?;
            ensure!(surplus.as_i64() <= Some(0), "{width}: {surplus} px too wide");
        }
        page.click("#language").await?;
        page.wait_for_text("#task h1", "Lektion 1").await?;
        page.click("#language").await?;

        page.click("[data-what=check]").await?;
        page.wait_for_text("#check", "Now start your program").await?;
        let is_over = Arc::new(AtomicBool::new(false));
        let (address, ends) = (lesson.program.clone(), Arc::clone(&is_over));
        let program = thread::spawn(move || lamp(&address, true, || ends.load(Ordering::Relaxed)));
        page.wait_for("#check li[data-sign=ok]").await?;
        page.wait_for_text("#check .verdict", "Solved.").await?;
        is_over.store(true, Ordering::Relaxed);
        ensure!(program.join().is_ok(), "the program has panicked");
        page.click("[data-what=next]").await?;
        page.wait_for_text("#task h1", "Lesson 2").await?;
        page.ensure_no_console_errors().await?;

        drop(lesson);
        page.wait_for_text("#notice", "has ended").await
    })
}

#[cfg_attr(not(unix), ignore = "the tests only know the names of browsers on Unix")]
#[test]
fn the_page_of_a_pupil_is_the_next_one_s_when_a_class_is_started_again() -> Result<()> {
    browse(|client| async move {
        let folder = tempfile::tempdir()?;
        let class = folder.path().join("7b.toml");
        let two = "[[pupils]]\nname = \"Ben\"\n[[pupils]]\nname = \"Zoe\"\nlesson = 1\n";
        fs::write(&class, two)?;
        let (first, _, pupils) = with_class(&[], folder.path());
        let page = Page { client: client.clone() };
        client.goto(link_in(&pupils[1])).await?;
        page.wait_for_text("#whose", "Zoe").await?;
        page.click("[data-what=check]").await?;
        page.wait_for_text("#check", "Now start your program").await?;
        drop(first);
        for (before, after, selector, text) in
            [("Zoe", "Lena", "#whose", "Lena"), ("lesson = 1", "world = \"car\"", "title", "Lena")]
        {
            fs::write(&class, fs::read_to_string(&class)?.replace(before, after))?;
            let (_next, _, _) = with_class(&[], folder.path());
            page.wait_for_text(selector, text).await?;
            let idle = "return document.querySelector(arguments[0]) === null";
            let gone = if selector == "title" { "#task" } else { "[data-what=end]" };
            page.wait_for_value(idle, gone, |is_gone| is_gone == true).await?;
        }
        Ok(())
    })
}
