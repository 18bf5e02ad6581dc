//! Chapter 7 of the thesis, runtime assurance: what of it is here, and by which command it is shown.

/// What the thesis has, what is here, the command that shows it, and what differs and why.
type Row = [&'static str; 4];

const SYSTEMS: [Row; 5] = [
    [
        "a drivetrain whose source of the speed fails",
        "`models/stability.yaml`, certificates of the services and of the substitute",
        "`shsa demo car`, `shsa assure models/stability.yaml`",
        "bounds and levels are examples of ours: no file of the thesis is public",
    ],
    [
        "a new service joins by an upgrade",
        "a reload brings signal, relation and certificate; nothing of them serves before it is admitted",
        "`shsa story stories/28-an-upgrade-brings-a-certificate.yaml`",
        "",
    ],
    [
        "a service runs on a platform (vertical direction)",
        "`platform:` and `runs_on:`; the computer has no time left",
        "`shsa demo stop`, `shsa assure models/stop.yaml`",
        "a platform demands nothing of single applications but by `of: consumers`",
    ],
    [
        "services of several systems (horizontal direction)",
        "two vehicles with an instance each; certificates compose over the network and degrade with the link",
        "`shsa demo platoon`, `cargo test -p shsa --test live platoon`",
        "a guarantee of another system arrives as a signal with its level and age, not as its certificate",
    ],
    [
        "redundant sources",
        "sonar and camera at SIL 1 together for SIL 2: a claim that is checked",
        "`shsa story stories/28-sonar-and-camera-together.yaml`",
        "no level follows from redundancy by itself (ISO 26262-9 clause 5, IEC 61508-2 7.4.3)",
    ],
];

const ALGORITHMS: [Row; 6] = [
    [
        "certificates are assessed at integration and after changes",
        "least fixed point by strongly connected components, kept up to date with the evidence",
        "`shsa-bench oracle assurance FILE`, `cargo bench -p shsa-core --bench assurance`",
        "three-valued: `open`, `circular` and `refused` are told apart, and evidence has an age",
    ],
    [
        "a substitution is assessed before it starts",
        "only an `Assured` substitution can be started; each value is admitted when it goes out",
        "`SHSA_SEEDS=10000 cargo test -p shsa-core --test all under_contract`",
        "a running substitute is assessed again with every input, not only at its start",
    ],
    [
        "the recovery searches a substitution, then assesses it",
        "contracts prune inside the search",
        "`cargo test -p shsa-core --test all the_best_admissible`, `cargo xtask ratchet`",
        "the best admissible substitution is found, where the best of all may be refused",
    ],
    [
        "an assessment says yes or no",
        "minimal sets of the leaves that would have to change",
        "`shsa assure models/stop.yaml --with evidence.yaml`",
        "who has to decide needs the reason",
    ],
    [
        "the consequence of evidence that fails",
        "for every leaf what would serve then, before it is needed",
        "`shsa plan models/stop.yaml --contingency`",
        "",
    ],
    [
        "the certificate as part of the assurance case",
        "the case in the Goal Structuring Notation, at one moment and over a recording",
        "`shsa assure models/stop.yaml --format gsn`, `--over RECORDING`",
        "",
    ],
];

const QUESTIONS: [Row; 5] = [
    [
        "ConSerts M has no public format",
        "`contracts:` beside signals, relations and needs; files of conserts-rs and safeTbox are read",
        "`shsa help model`, `cargo test -p shsa-format conserts`",
        "certificates do not say who meets whose demands: that follows from the flow that serves",
    ],
    [
        "what self-healing costs at run time",
        "one change in 1,000 certificates without allocation; a search under contract within a fifth of one without",
        "`cargo bench -p shsa-core --bench assurance`, `cargo xtask ratchet`",
        "",
    ],
    [
        "which level a substitute has",
        "the highest that its own certificate states and its sources give now",
        "`cargo test -p shsa-core --test all no_level_is_raised`",
        "the thesis names levels without a scale; here each scale is its own, and nothing converts them",
    ],
    [
        "who assures the healer",
        "a contract of the name `shsa`: no relation gives a level that the program does not give",
        "`cargo test -p shsa-format contracts`",
        "the program claims no level of its own",
    ],
    [
        "what an operator may do",
        "an override with a reason, which ends by itself and raises no level",
        "`shsa story stories/28-an-override-with-a-reason-and-an-end.yaml`",
        "",
    ],
];

/// The chapter as Markdown.
pub(super) fn markdown() -> String {
    let parts =
        [("Systems", SYSTEMS.as_slice()), ("Algorithms", &ALGORITHMS), ("Open questions", &QUESTIONS)];
    let table = |(name, rows): (&str, &[Row])| {
        let rows: String = rows.iter().map(|row| format!("| {} |\n", row.join(" | "))).collect();
        format!(
            "### {name}\n\n| thesis | here | shown by | what differs, and why |\n|---|---|---|---|\n{rows}\n"
        )
    };
    format!("## Chapter 7: runtime assurance\n\n{}", parts.map(table).concat())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn root() -> &'static Path {
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
    }

    #[test]
    fn the_document_has_the_chapter() {
        let document = std::fs::read_to_string(root().join("docs/thesis.md")).unwrap();
        assert!(document.contains(markdown().trim_end()), "write docs/thesis.md anew:\n{}", markdown());
    }

    #[test]
    fn each_row_names_files_that_are_there() {
        let all = [SYSTEMS.as_slice(), &ALGORITHMS, &QUESTIONS].concat();
        let words =
            all.iter().flat_map(|[_, here, shown, _]| [here, shown]).flat_map(|text| text.split(['`', ' ']));
        let files: Vec<&str> =
            words.filter(|word| word.starts_with("models/") || word.starts_with("stories/")).collect();
        assert!(files.len() > 8, "{files:?}");
        assert_eq!(files.iter().find(|file| !root().join(file).is_file()), None);
        assert!(all.iter().all(|[.., shown, _]| shown.contains('`')));
    }
}
