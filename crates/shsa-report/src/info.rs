//! The contents of recordings, which `shsa_recording::inventory` lists, as one JSON object.

use serde_json::{Value, json};
use shsa_recording::{FileInfo, TopicInfo};

/// The contents of files; `docs/json.md` lists the fields.
#[must_use]
pub fn json(files: &[FileInfo]) -> Value {
    let of_file = |file: &FileInfo| {
        json!({
            "file": file.file.display().to_string(),
            "format": file.format,
            "degraded": file.degraded,
            "warnings": file.warnings.iter().map(ToString::to_string).collect::<Vec<_>>(),
            "topics": file.topics.iter().map(of_topic).collect::<Vec<_>>(),
        })
    };
    let topics = files.iter().flat_map(|file| &file.topics);
    let counted = topics.map(|it| json!({ "topic": it.name, "source": it.source, "messages": it.count }));
    let topics: Vec<Value> = counted.collect();
    json!({ "files": files.iter().map(of_file).collect::<Vec<_>>(), "topics": topics })
}

fn of_topic(topic: &TopicInfo) -> Value {
    let fields = topic.fields.iter().map(
        |field| json!({ "path": field.path, "unit": field.unit, "kind": field.kind, "sample": field.sample }),
    );
    json!({
        "topic": topic.name,
        "source": topic.source,
        "type": topic.kind,
        "messages": topic.count,
        "from_ns": topic.span.map(|(from, _)| from.0),
        "to_ns": topic.span.map(|(_, to)| to.0),
        "rate_hz": topic.rate_hz,
        "longest_gap_s": topic.longest_gap.map(shsa_core::time::Span::seconds),
        "unreadable": topic.unreadable,
        "fields": fields.collect::<Vec<_>>(),
    })
}
