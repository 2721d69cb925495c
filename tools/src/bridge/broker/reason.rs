//! Why there is no connection to a broker, as a sentence.

use std::io;

use rumqttc::mqttbytes::Error as Decoding;
use rumqttc::{ConnectReturnCode, ConnectionError, StateError};

use super::{Broker, MESSAGE_LIMIT};

impl Broker {
    /// Why a connection failed.
    pub(super) fn reason(&self, error: &ConnectionError) -> String {
        let at = self.at();
        match error {
            ConnectionError::Io(cause) => {
                format!("{at} can't be reached ({cause}); check its address and that it runs")
            }
            ConnectionError::ConnectionRefused(code) => refusal(&at, *code),
            // What is read and what is written goes through the same place as what is decoded.
            ConnectionError::MqttState(
                StateError::Io(cause) | StateError::Deserialization(Decoding::Io(cause)),
            ) => broken(&at, cause),
            ConnectionError::MqttState(StateError::ConnectionAborted) => closed(&at),
            ConnectionError::NetworkTimeout
            | ConnectionError::FlushTimeout
            | ConnectionError::MqttState(
                StateError::AwaitPingResp | StateError::CollisionTimeout,
            ) => self.silent(),
            ConnectionError::MqttState(StateError::Deserialization(
                Decoding::PayloadSizeLimitExceeded(size),
            )) => format!(
                "{at} sent a message of {size} bytes, but more than {MESSAGE_LIMIT} are not read; \
                 find out who sends such commands"
            ),
            other => format!(
                "{at} sent what is not MQTT 3.1.1 ({other}); check that it is a broker, and its port"
            ),
        }
    }

    pub(super) fn silent(&self) -> String {
        format!("{} was silent for {:?}; check it and the network", self.at(), self.limit)
    }

    fn at(&self) -> String {
        format!("the broker at {}:{}", self.host, self.port)
    }
}

fn closed(at: &str) -> String {
    format!("{at} closed the connection; it was stopped or restarted, or does not want this client")
}

fn broken(at: &str, cause: &io::Error) -> String {
    use io::ErrorKind::{BrokenPipe, ConnectionAborted, ConnectionReset, UnexpectedEof};
    match cause.kind() {
        BrokenPipe | ConnectionAborted | ConnectionReset | UnexpectedEof => closed(at),
        _ => format!("the connection to {at} broke ({cause}); check the network"),
    }
}

fn refusal(at: &str, code: ConnectReturnCode) -> String {
    match code {
        ConnectReturnCode::BadUserNamePassword | ConnectReturnCode::NotAuthorized => format!(
            "{at} refuses this user; check --user, and the password in the environment variable \
             TXT_MQTT_PASSWORD"
        ),
        other => format!("{at} refuses the connection ({other:?})"),
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    fn reason(error: StateError) -> String {
        let broker = Broker::new("b", None, Duration::from_secs(4)).unwrap();
        broker.reason(&ConnectionError::MqttState(error))
    }

    #[test]
    fn an_error_of_the_network_is_none_of_the_protocol() {
        let decoding = |kind| StateError::Deserialization(Decoding::Io(io::Error::from(kind)));
        for error in [
            decoding(io::ErrorKind::ConnectionReset),
            decoding(io::ErrorKind::BrokenPipe),
            StateError::Io(io::ErrorKind::UnexpectedEof.into()),
            StateError::ConnectionAborted,
        ] {
            let sentence = reason(error);
            assert!(sentence.starts_with("the broker at b:1883 closed the"), "{sentence}");
        }
        let sentence = reason(decoding(io::ErrorKind::HostUnreachable));
        assert!(sentence.contains("check the network"), "{sentence}");
    }

    #[test]
    fn what_is_wrong_in_the_protocol_is_told_as_what_it_is() {
        let sentence = reason(StateError::Deserialization(Decoding::PayloadSizeLimitExceeded(9)));
        assert!(sentence.contains("a message of 9 bytes"), "{sentence}");
        let sentence = reason(StateError::Deserialization(Decoding::InvalidPacketType(0)));
        assert!(sentence.contains("not MQTT 3.1.1"), "{sentence}");
        let sentence = reason(StateError::AwaitPingResp);
        assert!(sentence.contains("was silent for 4s"), "{sentence}");
    }
}
