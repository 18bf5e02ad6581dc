//! A page of the reference as tests read it: sections, tables, blocks.

/// A Markdown text, or a section of one.
pub(crate) struct Document {
    pub(crate) name: String,
    text: String,
}

impl Document {
    /// A file of `docs/`.
    pub(crate) fn read(name: &str) -> Document {
        let path = format!("{}/../../docs/{name}", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
        Document { name: name.to_owned(), text }
    }

    /// From a heading, whatever its level, to the next heading that is not below it.
    pub(crate) fn section(&self, heading: &str) -> Document {
        let level = |line: &str| line.chars().take_while(|&c| c == '#').count();
        let mut lines = self
            .text
            .lines()
            .skip_while(|line| level(line) == 0 || line.trim_start_matches('#').trim() != heading);
        let first = lines.next().unwrap_or_else(|| panic!("{}: no section {heading}", self.name));
        let mut is_block = false;
        let is_inside = |line: &&str| {
            is_block ^= line.starts_with("```");
            is_block || level(line) == 0 || level(line) > level(first)
        };
        let text = lines.take_while(is_inside).collect::<Vec<_>>().join("\n");
        Document { name: format!("{}, {heading}", self.name), text }
    }

    /// The cells of all rows of the tables whose first column has this head.
    pub(crate) fn rows(&self, head: &str) -> Vec<Vec<String>> {
        let mut rows = Vec::new();
        let mut is_wanted = None;
        for line in self.text.lines() {
            let Some(cells) = cells(line) else {
                is_wanted = None;
                continue;
            };
            match is_wanted {
                None => is_wanted = Some(cells[0] == head),
                Some(true) if !cells[0].starts_with("---") => rows.push(cells),
                Some(_) => {}
            }
        }
        assert!(!rows.is_empty(), "{}: no table `{head}`", self.name);
        rows
    }

    /// What the first cells of these rows name: every piece of code in them.
    pub(crate) fn named(&self, head: &str) -> Vec<String> {
        self.rows(head).iter().flat_map(|row| code(&row[0])).collect()
    }

    /// The blocks of a language.
    pub(crate) fn blocks(&self, language: &str) -> Vec<String> {
        let fence = format!("```{language}\n");
        let blocks = self.text.split(&fence).skip(1);
        blocks.map(|rest| rest.split("```").next().unwrap_or_default().to_owned()).collect()
    }

    /// That a table names exactly what the code has, each once.
    #[track_caller]
    pub(crate) fn names_exactly<'a>(&self, head: &str, code: impl IntoIterator<Item = &'a str>) {
        let mut named = self.named(head);
        let mut known: Vec<&str> = code.into_iter().collect();
        let missing: Vec<_> = known.iter().filter(|name| !named.iter().any(|named| named == *name)).collect();
        let unknown: Vec<_> = named.iter().filter(|named| !known.contains(&named.as_str())).collect();
        assert!(missing.is_empty(), "{}: not described: {missing:?}", self.name);
        assert!(unknown.is_empty(), "{}: not in the code: {unknown:?}", self.name);
        named.sort();
        known.sort_unstable();
        assert_eq!(named, known, "{}: described twice", self.name);
    }
}

/// The pieces of code in a text.
pub(crate) fn code(text: &str) -> Vec<String> {
    text.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

fn cells(line: &str) -> Option<Vec<String>> {
    let inner = line.trim().strip_prefix('|')?.strip_suffix('|')?;
    let marked = inner.replace("\\|", "\u{1}");
    Some(marked.split('|').map(|cell| cell.trim().replace('\u{1}', "|")).collect())
}
