//! Bridges of ROS 2 as the contract sees bridges: of payloads that are texts.

use bytes::Bytes;
use shsa_bridge::{
    Answer, Bridge, BridgeError, Inbox, Link, Message, Outgoing, Payload, PublisherId, Server, Taker,
};
use std::time::Duration;

/// The contract is about payloads; here a payload is the text of a message.
pub(crate) struct Texts<B>(pub(crate) B);

impl<B: Bridge> Bridge for Texts<B> {
    fn publisher(&self) -> PublisherId {
        self.0.publisher()
    }

    fn inbox(&self) -> &Inbox {
        self.0.inbox()
    }

    fn subscribe(&mut self, topic: &str, message_type: Option<&str>) -> Result<(), BridgeError> {
        self.0.subscribe(topic, message_type)
    }

    fn subscribe_all(&mut self) -> Result<(), BridgeError> {
        self.0.subscribe_all()
    }

    fn publish(&mut self, message: Outgoing<'_>) -> Result<(), BridgeError> {
        self.0.publish(message)
    }

    fn link(&self) -> Link {
        self.0.link()
    }

    fn knows_own(&self) -> bool {
        self.0.knows_own()
    }

    fn request(&mut self, to: &str, payload: Bytes, within: Duration) -> Result<Answer, BridgeError> {
        self.0.request(to, payload, within)
    }

    fn serve(&mut self, name: &str, answers: &str, server: Server) -> Result<(), BridgeError> {
        self.0.serve(name, answers, server)
    }

    fn ask(&self, name: &str, longest: usize, take: Taker) -> Result<(), BridgeError> {
        self.0.ask(name, longest, take)
    }

    fn receive(&mut self) -> Option<Message> {
        let message = self.0.receive()?;
        let Payload::Bytes(bytes) = &message.payload else { panic!("a message of ROS is bytes") };
        // The text stands between the header with its length and a zero byte, which may be followed by padding.
        let length = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
        let text = bytes.slice(8..8 + length - 1);
        Some(Message { payload: Payload::Bytes(text), ..message })
    }
}
