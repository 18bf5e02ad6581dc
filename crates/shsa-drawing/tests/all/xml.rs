//! A strict reader of the XML that drawings consist of: an oracle for well-formedness.

/// An element with all that is in it.
#[derive(Debug, Default)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) attributes: Vec<(String, String)>,
    pub(crate) children: Vec<Element>,
    /// The text directly in it, unescaped.
    pub(crate) text: String,
}

impl Element {
    pub(crate) fn attribute(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(name, _)| name == key).map(|(_, value)| &**value)
    }

    /// Itself and all below it.
    pub(crate) fn all(&self) -> Vec<&Element> {
        let mut all = vec![self];
        let mut next = 0;
        while let Some(element) = all.get(next) {
            all.extend(&element.children);
            next += 1;
        }
        all
    }

    /// The texts of all elements of a name.
    pub(crate) fn texts(&self, name: &str) -> Vec<&str> {
        self.all().into_iter().filter(|element| element.name == name).map(|element| &*element.text).collect()
    }

    /// How many elements have a class.
    pub(crate) fn count(&self, class: &str) -> usize {
        let has = |element: &&&Element| {
            element.attribute("class").is_some_and(|classes| classes.split(' ').any(|one| one == class))
        };
        self.all().iter().filter(has).count()
    }
}

/// Reads one element and nothing else.
pub(crate) fn parse(text: &str) -> Result<Element, String> {
    let mut open: Vec<Element> = Vec::new();
    let mut rest = text.trim_end();
    loop {
        let (before, tag) = rest.split_once('<').ok_or("the root is never closed")?;
        let (tag, after) = tag.split_once('>').ok_or("a tag is never closed")?;
        match open.last_mut() {
            Some(element) => element.text += &unescaped(before)?,
            None if before.is_empty() => {}
            None => return Err(format!("text before the root: {before}")),
        }
        rest = after;
        let closed = match tag.strip_prefix('/') {
            Some(name) => {
                let element = open.pop().ok_or("a closing tag too many")?;
                if element.name != name {
                    return Err(format!("<{}> is closed by </{name}>", element.name));
                }
                Some(element)
            }
            None => {
                let (tag, empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
                let element = opening(tag)?;
                match empty {
                    true => Some(element),
                    false => {
                        open.push(element);
                        None
                    }
                }
            }
        };
        if let Some(element) = closed {
            match open.last_mut() {
                Some(parent) => parent.children.push(element),
                None if rest.is_empty() => return Ok(element),
                None => return Err(format!("behind the root: {rest}")),
            }
        }
    }
}

fn opening(tag: &str) -> Result<Element, String> {
    let (name, mut rest) = tag.split_once([' ', '\n']).unwrap_or((tag, ""));
    let is_name =
        |name: &str| !name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
    if !is_name(name) {
        return Err(format!("<{tag}> has no name"));
    }
    let mut element = Element { name: name.to_owned(), ..Element::default() };
    while !rest.trim_start().is_empty() {
        let (key, value) = rest.trim_start().split_once("=\"").ok_or(format!("<{tag}>: no value"))?;
        let (value, after) = value.split_once('"').ok_or(format!("<{tag}>: no closing quote"))?;
        if !is_name(key) || element.attribute(key).is_some() {
            return Err(format!("<{tag}>: attribute {key:?}"));
        }
        element.attributes.push((key.to_owned(), unescaped(value)?));
        rest = after;
    }
    Ok(element)
}

fn unescaped(text: &str) -> Result<String, String> {
    const ENTITIES: [(&str, char); 5] =
        [("amp;", '&'), ("lt;", '<'), ("gt;", '>'), ("quot;", '"'), ("#39;", '\'')];
    if let Some(odd) = text.chars().find(|char| char.is_control() && !matches!(char, '\n' | '\t')) {
        return Err(format!("the character {odd:?}"));
    }
    let mut parts = text.split('&');
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let (entity, char) =
            ENTITIES.iter().find(|(entity, _)| part.starts_with(entity)).ok_or(format!("&{part}"))?;
        plain.push(*char);
        plain += part.strip_prefix(entity).unwrap_or_default();
    }
    Ok(plain)
}

#[test]
fn what_is_not_well_formed_is_found() {
    for wrong in
        ["<a><b></a>", "<a x=1/>", "<a>&</a>", "<a/><b/>", "<a", "<a>\u{1}</a>", "<a x=\"1\" x=\"2\"/>"]
    {
        assert!(parse(wrong).is_err(), "{wrong}");
    }
    let root = parse("<a x=\"&lt;\">1<b class=\"c d\"/>&amp;</a>\n").unwrap();
    assert_eq!((root.attribute("x"), &*root.text, root.count("d")), (Some("<"), "1&", 1));
}
