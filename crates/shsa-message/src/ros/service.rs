//! Services of ROS 2 in recordings: each call is recorded as events, at the client and at the server.

/// The parts of a service's definition, before and behind a line of three minuses; `None` for a message.
pub(super) fn divided(definition: &str) -> Option<(&str, &str)> {
    let mut at = 0;
    for line in definition.split_inclusive('\n') {
        let end = at + line.len();
        match line.trim() {
            "---" => return Some((definition.get(..at)?, definition.get(end..)?)),
            // The types behind this line are messages.
            line if line.starts_with("===") => return None,
            _ => at = end,
        }
    }
    None
}

/// The definition of a service's events, in which the request, the response or neither is there (ROS 2, REP 2012).
pub(super) fn event(root: &str) -> String {
    format!(
        "service_msgs/msg/ServiceEventInfo info\n{root}_Request[<=1] request\n{root}_Response[<=1] response\n"
    )
}

#[cfg(test)]
mod tests {
    use crate::MessageError;
    use crate::ros::Types;

    #[test]
    fn a_service_is_recorded_as_its_events() {
        let mut types = Types::beside(Types::standard());
        types
            .add_recorded("a/srv/Add_Event", "int64 a\nb/Part p\n---\nint64 sum\n===\nMSG: b/Part\nint8 x")
            .unwrap();
        let mut paths = Vec::new();
        types.paths("a/srv/Add_Event", "", 99, &mut paths).unwrap();
        let of_service = ["request[0].a", "request[0].p.x", "response[0].sum"];
        assert!(paths.ends_with(&of_service.map(str::to_owned)), "{paths:?}");
        assert_eq!(paths[0], "info.event_type");
        let action = types.add_recorded("a/action/Go", "int8 a\n---\nint8 b\n---\nint8 c");
        assert_eq!(action.unwrap_err(), MessageError::Action("a/action/Go".into()));
    }
}
