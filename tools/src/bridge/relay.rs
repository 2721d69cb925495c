//! Between the broker and one controller: takes commands, publishes values, and knows when to stop.

use std::collections::BTreeMap;
use std::mem;
use std::time::{Duration, Instant};

use crossbeam_channel::TryRecvError;
use ft_transfer_area::{Event, FishX1Transfer, TimedEvent};
use rumqttc::{LastWill, QoS};
use serde_json::Value;

use super::broker::{Broker, BrokerEvent, Inbox, Message, Publisher, Subscription};
use super::commands::Received;
use super::payload::short;
use super::report::{json, say, Complaint, Master, PublishedEvent, Stage, State};
use super::topics::{Addressed, Topics, ERROR, EVENT, MASTER, STATE};
use super::values::{Noise, Values};
use crate::commands::{stop_all, Reconfigured};
use crate::lines::{Changes, Rarely, Repeated};

/// How long the last messages may take to the broker.
const LEAVE_LIMIT: Duration = Duration::from_secs(2);

/// How many messages are read before the next cycle.
const AT_A_TIME: usize = 1000;

/// An older command is not carried out. The watchdog stops the motors after the same time.
pub(crate) const COMMAND_AGE: Duration = Duration::from_secs(1);

/// What a relay is set up with.
pub(crate) struct Setup {
    pub(crate) broker: Broker,
    pub(crate) topics: Topics,
    pub(crate) name: String,
    pub(crate) host: String,
    /// What people call the terminals, by their topics.
    pub(crate) names: BTreeMap<String, String>,
    pub(crate) noise: Noise,
    /// How long the master may be silent; `None` for as long as it likes.
    pub(crate) master_limit: Option<Duration>,
    /// How long a motor may stand still that should turn; `None` if that is not published.
    pub(crate) stall_limit: Option<Duration>,
}

pub(crate) struct Relay {
    setup: Setup,
    inbox: Inbox,
    publisher: Option<Publisher>,
    /// Whether there has been a connection to the broker.
    has_been_up: bool,
    state: State,
    values: Values,
    master: Master,
    /// When the master gave its last sign of life.
    heard: Instant,
    /// Why the motors were stopped, while this could not be published.
    untold: Option<String>,
    /// What was printed about the broker last.
    printed: Option<String>,
    /// For another bridge on this topic, which may send as much as it likes.
    another: Rarely,
    /// For lost changes, which may be some of each cycle, and how many were not printed.
    lost: Rarely,
    unprinted: u64,
    /// Stops, of which others may cause as many as they like.
    stops: Repeated,
    /// Connections that come and go.
    changes: Changes,
    /// Whether the motors were stopped because a command was too old, and this was not published yet.
    too_late: bool,
    /// Whether the broker has all values of the controller that answers.
    has_told_all: bool,
    due: Due,
}

/// What is kept at the broker and not as it should be: there was no room for it, or somebody else has replaced it.
#[derive(Default)]
struct Due {
    state: bool,
    master: bool,
}

impl Relay {
    pub(crate) fn open(setup: Setup) -> anyhow::Result<Self> {
        let state = State::at_start(&setup.host, &setup.names);
        let reason = Some("the bridge has lost its connection to the broker".to_owned());
        let gone = json(&State { state: Stage::Gone, reason, ..state.clone() });
        let will = LastWill::new(setup.topics.of(STATE), gone, QoS::AtLeastOnce, true);
        let subscription =
            Subscription { filters: setup.topics.filters(), unread: setup.topics.values() };
        let inbox = setup.broker.connect(will, subscription)?;
        Ok(Self::new(setup, state, inbox))
    }

    fn new(setup: Setup, state: State, inbox: Inbox) -> Self {
        let values = Values::new(&setup.topics, setup.noise);
        Self {
            setup,
            inbox,
            publisher: None,
            has_been_up: false,
            state,
            values,
            master: Master { alive: false },
            heard: Instant::now(),
            untold: None,
            printed: None,
            another: Rarely::default(),
            lost: Rarely::default(),
            unprinted: 0,
            stops: Repeated::default(),
            changes: Changes::default(),
            too_late: false,
            has_told_all: false,
            due: Due::default(),
        }
    }

    /// Without a broker: what comes from one is sent through a channel.
    #[cfg(test)]
    pub(crate) fn without_broker(setup: Setup, inbox: Inbox) -> Self {
        let state = State::at_start(&setup.host, &setup.names);
        Self::new(setup, state, inbox)
    }

    pub(crate) fn say(&self, line: &str) {
        say(&self.setup.name, line);
    }

    fn say_changed(&mut self, line: &str) {
        self.changes.printed_now(line, Instant::now()).iter().for_each(|line| self.say(line));
    }

    pub(crate) fn is(&self, stage: Stage) -> bool {
        self.state.state == stage
    }

    /// The controller answers.
    pub(crate) fn online(&mut self, device: Option<String>, firmware: Option<String>) {
        self.values.begin();
        self.has_told_all = false;
        self.state.device = device;
        self.state.firmware = firmware;
        self.enter(Stage::Online, None);
    }

    /// Publishes a new state, and says so.
    pub(crate) fn enter(&mut self, stage: Stage, reason: Option<String>) {
        if self.is(stage) && self.state.reason == reason {
            return;
        }
        match &reason {
            Some(reason) => self.say_changed(reason),
            None => self.say_changed(&format!("online as {}", self.setup.topics.of(""))),
        }
        (self.state.state, self.state.reason) = (stage, reason);
        self.due.state = true;
        self.publish_due();
    }

    fn publish_due(&mut self) {
        // Who reads `online` takes the values that the broker has for those of now.
        if self.due.state && (self.has_told_all || !self.is(Stage::Online)) {
            self.due.state = !self.publish(STATE, true, json(&self.state));
        }
        if self.due.master {
            self.due.master = !self.publish(MASTER, true, json(&self.master));
        }
    }

    /// The motors have been stopped: publishes why, and prints it if it was not printed in the last minute.
    pub(crate) fn stopped(&mut self, reason: String) {
        let line = format!("all motors are stopped: {reason}\n");
        let text = self.stops.printed_now(&line, Instant::now());
        text.iter().flat_map(|text| text.lines()).for_each(|line| self.say(line));
        let reported = json(&PublishedEvent::Stopped { reason: reason.clone() });
        if !self.publish(EVENT, false, reported) {
            self.untold = Some(reason);
        }
    }

    /// Reads what has come from the broker. With areas, commands change them; without, they are refused.
    pub(crate) fn read(&mut self, mut areas: Option<&mut [FishX1Transfer]>) -> anyhow::Result<()> {
        let mut events = Vec::new();
        for _ in 0..AT_A_TIME {
            match self.inbox.read() {
                Ok(event) => events.push(event),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => {
                    anyhow::bail!("the thread that talks to the broker has ended")
                }
            }
        }
        // One of those for which there was no room may have been a stop, or may have followed one. So none of the
        // others counts.
        let missed = self.inbox.missed();
        let mut discarded = missed;
        for event in events {
            match event {
                BrokerEvent::Message(_) if missed > 0 => discarded += 1,
                event => self.take(event, areas.as_deref_mut())?,
            }
        }
        if discarded > 0 {
            let reason = format!(
                "{discarded} messages came faster than they could be carried out, so none of them \
                 was; send fewer"
            );
            self.report_error(&self.setup.topics.of("+"), &reason);
            self.stop(areas.as_deref_mut(), reason);
        }
        if mem::take(&mut self.too_late) {
            let reason = "commands waited for too long: the bridge was suspended, its computer busy, or the controller slow to answer";
            self.stopped(reason.to_owned());
        }
        self.check_master(areas);
        self.publish_due();
        Ok(())
    }

    fn stop(&mut self, areas: Option<&mut [FishX1Transfer]>, reason: String) {
        if let Some(areas) = areas {
            stop_all(areas);
            self.stopped(reason);
        }
    }

    fn take(
        &mut self,
        event: BrokerEvent,
        areas: Option<&mut [FishX1Transfer]>,
    ) -> anyhow::Result<()> {
        match event {
            BrokerEvent::Up(publisher) => self.connected(publisher),
            BrokerEvent::Refused(reason) if !self.has_been_up => anyhow::bail!(reason),
            BrokerEvent::Down(reason) | BrokerEvent::Refused(reason) => self.lose(reason, areas),
            BrokerEvent::Message(message) => self.answer(&message, areas),
        }
        Ok(())
    }

    /// Tells a broker everything, as it may know nothing.
    fn connected(&mut self, publisher: Publisher) {
        self.publisher = Some(publisher);
        self.has_been_up = true;
        self.printed = None;
        self.say_changed("connected to the broker");
        self.values.forget();
        self.has_told_all = false;
        self.due = Due { state: true, master: true };
        self.publish_due();
        if let Some(reason) = self.untold.take() {
            self.publish(EVENT, false, json(&PublishedEvent::Stopped { reason }));
        }
    }

    fn lose(&mut self, reason: String, areas: Option<&mut [FishX1Transfer]>) {
        let was_up = self.publisher.take().is_some();
        self.master.alive = false;
        if let Some(areas) = areas {
            stop_all(areas);
        }
        if was_up {
            self.stopped(reason);
        } else if self.printed.as_ref() != Some(&reason) {
            self.say_changed(&format!("{reason}; trying again"));
            self.printed = Some(reason);
        }
    }

    fn answer(&mut self, message: &Message, areas: Option<&mut [FishX1Transfer]>) {
        match self.setup.topics.addressed(&message.topic) {
            Some(Addressed::Command(tail)) => {
                if let Err(error) = self.carry_out(tail, message, areas) {
                    self.report_error(&message.topic, &error);
                }
            }
            Some(Addressed::State) => self.look_for_another_bridge(message),
            None => {}
        }
    }

    fn carry_out(
        &mut self,
        tail: &str,
        message: &Message,
        areas: Option<&mut [FishX1Transfer]>,
    ) -> Result<(), String> {
        if message.retained {
            return Err(
                "the broker had kept this command, so it may be old and does nothing; send \
                        commands without the retain flag"
                    .to_owned(),
            );
        }
        let command = Received::parse(tail, &message.payload)?;
        let age = message.not_before.elapsed();
        if age > COMMAND_AGE && command != Received::StopAll {
            // Whatever it was to change did not change in time.
            if let Some(areas) = areas {
                stop_all(areas);
                self.too_late = true;
            }
            return Err(format!(
                "the command may have waited {age:.1?} in the bridge and does nothing, \
                 because only those of the last {COMMAND_AGE:?} do; all motors are stopped; send a \
                 new one"
            ));
        }
        self.heard = Instant::now();
        self.set_master(true);
        match areas {
            Some(areas) => command.apply(areas),
            None if command.needs_nothing() => Ok(()),
            None => Err("the controller is not online, so the command does nothing".to_owned()),
        }
    }

    /// Two bridges of one name would both do what is commanded. When one of them is gone, this one is not; nor is it when
    /// the broker learns late that an earlier connection of this one was lost.
    fn look_for_another_bridge(&mut self, message: &Message) {
        let reported: Value = serde_json::from_slice(&message.payload).unwrap_or_default();
        let is_other = reported["bridge"].as_str().is_some_and(|other| other != self.state.bridge);
        if reported["state"] == "gone" {
            // What the broker had kept was replaced at the beginning.
            if !message.retained {
                self.due.state = true;
                if is_other {
                    self.has_told_all = false;
                    self.values.forget();
                }
            }
        } else if is_other && self.another.is_due() {
            let topic = self.setup.topics.of(STATE);
            let error = format!(
                "another bridge uses this topic ({}); if it still runs, give each its own --name",
                short(reported["host"].as_str().unwrap_or("of an unknown controller")),
            );
            self.say(&error);
            self.report_error(&topic, &error);
        }
    }

    fn check_master(&mut self, areas: Option<&mut [FishX1Transfer]>) {
        let Some(limit) = self.setup.master_limit else { return };
        if !self.master.alive || self.heard.elapsed() < limit {
            return;
        }
        self.set_master(false);
        self.stop(areas, format!("no command and no heartbeat came for {limit:?}"));
    }

    fn set_master(&mut self, alive: bool) {
        if self.master.alive != alive {
            self.master.alive = alive;
            self.due.master = true;
            self.publish_due();
        }
    }

    /// Tells the values that have changed, of areas that show this response.
    pub(crate) fn publish_areas(
        &mut self,
        areas: &[FishX1Transfer],
        reconfigured: &Reconfigured,
        cycle: u64,
    ) {
        let Some(publisher) = &self.publisher else { return };
        let send = |topic: &str, payload: String| publisher.send(topic, true, payload);
        self.has_told_all |= self.values.publish(areas, reconfigured, cycle, Instant::now(), send);
        self.publish_due();
    }

    /// Tells what a response has shown; `false` when the broker is too slow for it.
    pub(crate) fn publish_event(&mut self, reported: &TimedEvent) -> bool {
        let Some(publisher) = &self.publisher else { return true };
        if let Event::InputChanged { area, input, pressed, .. } = reported.event {
            let send = |topic: &str, payload: String| publisher.send(topic, true, payload);
            return self.values.publish_change((area, input), pressed, reported.cycle, send);
        }
        PublishedEvent::new(&reported.event)
            .is_none_or(|happened| self.publish(EVENT, false, json(&happened)))
    }

    pub(crate) fn publish_lost(&mut self, changes: u64) {
        self.unprinted += changes;
        if self.lost.is_due() {
            self.say_lost();
        }
        self.publish(EVENT, false, json(&PublishedEvent::Lost { changes }));
    }

    fn say_lost(&mut self) {
        let changes = std::mem::take(&mut self.unprinted);
        if changes > 0 {
            self.say(&format!("{changes} changes came faster than the broker takes them"));
        }
    }

    fn report_error(&self, topic: &str, error: &str) {
        let topic = &self.setup.topics.reported(topic);
        self.publish(ERROR, false, json(&Complaint { topic, error }));
    }

    fn publish(&self, tail: &str, retain: bool, payload: String) -> bool {
        let topic = self.setup.topics.of(tail);
        self.publisher.as_ref().is_some_and(|publisher| publisher.send(&topic, retain, payload))
    }

    /// Says goodbye, and waits until the broker has it.
    pub(crate) fn leave(mut self, reason: &str) {
        self.say_lost();
        self.enter(Stage::Gone, Some(reason.to_owned()));
        let Some(publisher) = self.publisher.take() else { return };
        if !publisher.leave() {
            return;
        }
        let deadline = Instant::now() + LEAVE_LIMIT;
        loop {
            match self.inbox.wait(deadline) {
                Ok(BrokerEvent::Message(_)) => {}
                // The connection broke, the thread has ended, or the broker is too slow.
                Ok(BrokerEvent::Up(_) | BrokerEvent::Down(_) | BrokerEvent::Refused(_))
                | Err(_) => return,
            }
        }
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use rumqttc::{AsyncClient, EventLoop, MqttOptions};

    use super::*;
    use crate::bridge::broker::Outlet;

    pub(crate) fn setup(host: String) -> Setup {
        Setup {
            broker: Broker::new("127.0.0.1", None, Duration::from_secs(4)).unwrap(),
            topics: Topics::new("ft", "press"),
            name: "press".to_owned(),
            host,
            names: Default::default(),
            noise: Noise { every: Duration::ZERO, deadband: 1 },
            master_limit: None,
            stall_limit: None,
        }
    }

    /// A connection with room for so many messages, which nothing takes out.
    fn publisher(room: usize) -> (Publisher, EventLoop) {
        let (client, events) = AsyncClient::new(MqttOptions::new("a", "127.0.0.1", 1), room);
        (Publisher::of(client), events)
    }

    #[test]
    fn what_the_broker_keeps_is_published_as_soon_as_there_is_room() {
        let (_outlet, inbox) = Outlet::new();
        let mut relay = Relay::without_broker(setup("127.0.0.1".to_owned()), inbox);
        let (full, _events) = publisher(1);
        relay.connected(full);
        relay.enter(Stage::Gap, Some("as a test".to_owned()));
        relay.read(None).unwrap();
        assert!(relay.due.state && relay.due.master);
        let (empty, _events) = publisher(2);
        relay.publisher = Some(empty);
        relay.read(None).unwrap();
        assert!(!relay.due.state && !relay.due.master);
    }
}
