//! Logs in XML (KUKA RSI, ABB EGM and the like) as a table: one row a record, one column a leaf or attribute.
use quick_xml::events::Event;
use quick_xml::reader::Reader;
use std::collections::HashMap;

/// Fewest records of a log.
const FEWEST: usize = 8;

/// One record with the lines on which it begins.
type Record = HashMap<String, String>;

/// The table of a log: a header and rows with `,` between the fields. `None` for XML that is no log.
pub(super) fn table(text: &str) -> Option<String> {
    // Records may follow each other without a root, or stand under one.
    [0, 1, 2]
        .into_iter()
        .find_map(|depth| records(text, depth))
        .map(|(names, records)| {
            let mut table = names.join(",") + "\n";
            for record in records {
                let field = |name: &String| {
                    record
                        .get(name)
                        .map_or("", String::as_str)
                        .replace(',', ".")
                };
                let fields: Vec<String> = names.iter().map(field).collect();
                table += &(fields.join(",") + "\n");
            }
            table
        })
}

/// The names of the leaves in order of first appearance, and the elements at a depth.
fn records(text: &str, depth: usize) -> Option<(Vec<String>, Vec<Record>)> {
    let mut reader = Reader::from_str(text);
    // Logs of packets have no root: an end that fits no start is then no fault.
    reader.config_mut().check_end_names = false;
    let (mut names, mut found): (Vec<String>, Vec<Record>) = (Vec::new(), Vec::new());
    let mut path: Vec<String> = Vec::new();
    let mut keep = |record: &mut Record, key: String, value: &str| {
        let value = value.trim();
        if !key.is_empty() && !value.is_empty() {
            if !names.contains(&key) {
                names.push(key.clone());
            }
            record.insert(key, value.to_owned());
        }
    };
    loop {
        let event = reader.read_event().ok()?;
        match &event {
            Event::Start(element) | Event::Empty(element) => {
                path.push(element.name().as_ref().to_owned());
                if path.len() == depth + 1 {
                    found.push(Record::new());
                }
                if let (true, Some(record)) = (path.len() > depth, found.last_mut()) {
                    let within = path[depth + 1..].join(".");
                    for attribute in element.attributes().filter_map(Result::ok) {
                        let key = format!("{within}.{}", attribute.key.as_ref());
                        keep(
                            record,
                            key.trim_start_matches('.').to_owned(),
                            &attribute.value,
                        );
                    }
                }
                if matches!(event, Event::Empty(_)) {
                    path.pop();
                }
            }
            Event::Text(content) if path.len() > depth + 1 => {
                if let Some(record) = found.last_mut() {
                    keep(record, path[depth + 1..].join("."), content);
                }
            }
            Event::End(_) => {
                path.pop();
            }
            Event::Eof => break,
            _ => {}
        }
    }
    found.retain(|record| !record.is_empty());
    (found.len() >= FEWEST).then_some((names, found))
}

#[cfg(test)]
mod tests {
    use super::table;

    #[test]
    fn packets_of_rsi_become_rows() {
        let packet = |k: i32| {
            format!(
                "<Rob Type=\"KUKA\"><RIst X=\"{k}.5\" Y=\"2\" Z=\"3\" A=\"0\"/><IPOC>{}</IPOC></Rob>\n",
                1000 + 4 * k
            )
        };
        let bare: String = (0..9).map(packet).collect();
        for text in [
            bare.clone(),
            format!("<?xml version=\"1.0\"?>\n<Log>{bare}</Log>"),
        ] {
            let found = table(&text).unwrap();
            let mut lines = found.lines();
            assert_eq!(lines.next(), Some("Type,RIst.X,RIst.Y,RIst.Z,RIst.A,IPOC"));
            assert_eq!(lines.next(), Some("KUKA,0.5,2,3,0,1000"));
            assert_eq!(found.lines().count(), 10);
        }
        assert_eq!(table("<BALLBAR><FEATURE NAME=\"A\"/></BALLBAR>"), None);
        assert_eq!(table("no XML at all <"), None);
    }
}
