//! Reader of a page of well-formed markup.

/// Page with well nested elements.
pub struct Markup<'a> {
    text: &'a str,
}

impl<'a> Markup<'a> {
    /// Checks that every element is closed, attributes are quoted and ids are unique.
    pub fn read(text: &'a str) -> Self {
        let body = text.strip_prefix("<!DOCTYPE html>\n").expect("it is HTML");
        let mut open: Vec<&str> = Vec::new();
        let mut ids: Vec<&str> = Vec::new();
        for piece in body.split('<').skip(1) {
            let (tag, words) = piece.split_once('>').expect("every tag ends");
            assert!(!words.contains('>'), "{piece}");
            for part in words.split('&').skip(1) {
                assert!(part.contains(';'), "a bare ampersand: {words}");
            }
            assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
            if let Some(name) = tag.strip_prefix('/') {
                assert_eq!(open.pop(), Some(name), "closes another element");
                continue;
            }
            if let Some((_, id)) = tag.split_once(" id=\"") {
                let id = id.split('"').next().unwrap();
                assert!(!ids.contains(&id), "{id} twice");
                ids.push(id);
            }
            if !tag.ends_with('/') {
                open.push(tag.split(' ').next().unwrap());
            }
        }
        assert!(open.is_empty(), "left open: {open:?}");
        Self { text }
    }

    /// Ids of the elements `name` in document order.
    pub fn ids(&self, name: &str) -> Vec<&str> {
        let start = format!("<{name} id=\"");
        let pieces = self.text.split(start.as_str()).skip(1);
        pieces.map(|piece| piece.split('"').next().unwrap()).collect()
    }

    /// Text of the element `name` with the given id. The element must not contain another one of
    /// its name.
    pub fn element(&self, name: &str, id: &str) -> &str {
        let start = self.text.find(&format!("<{name} id=\"{id}\"")).expect(id);
        let end = self.text[start..].find(&format!("</{name}>")).unwrap();
        &self.text[start..start + end]
    }
}
