//! Unit tests of `key_index.rs`.

use super::*;
use crate::contact::PairFeatures;
use crate::geometry::{Feature, PieceSide};

struct Keyed(ContactKey);

impl AsRef<ContactKey> for Keyed {
    fn as_ref(&self) -> &ContactKey {
        &self.0
    }
}

fn key(body: usize, point: usize, other: usize, plane: u32) -> ContactKey {
    let feature = Feature::Vertex(PieceSide::A, point as u32);
    let pair = Some(PairFeatures { pieces: (point % 2, 0), feature, plane });
    ContactKey { body, point, partner: Partner::Body(other), pair }
}

fn linear(contacts: &[Keyed], key: &ContactKey, near: usize) -> Option<usize> {
    let near = near.min(contacts.len());
    (near..contacts.len()).chain(0..near).find(|place| contacts[*place].0 == *key)
}

#[test]
fn index_agrees_with_linear_search_as_the_list_grows() {
    let mut index = KeyIndex::new();
    let mut contacts = Vec::new();
    for count in 0..300_usize {
        // Some keys occur twice.
        contacts.push(Keyed(key(count % 17, count % 5, 17 + count % 7, (count % 2) as u32)));
        for asked in 0..count + 3 {
            let wanted = key(asked % 17, asked % 5, 17 + asked % 7, (asked % 3) as u32);
            let near = (7 * asked) % (count + 5);
            let found = index.place(&contacts, &wanted, near);
            assert_eq!(found, linear(&contacts, &wanted, near), "{count} {asked}");
        }
    }
}

#[test]
fn contacts_between_two_pieces_come_in_their_order_from_either_side() {
    let mut index = PieceIndex::default();
    let contacts: Vec<_> = (0..200).map(|i| Keyed(key(i % 9, i % 4, 9 + i % 3, 0))).collect();
    for contact in &contacts {
        let [a, b] = ends_of(&contact.0);
        let same = |place: &usize| {
            let [c, d] = ends_of(&contacts[*place].0);
            [c, d] == [a, b] || [d, c] == [a, b]
        };
        let wanted: Vec<_> = (0..contacts.len()).filter(same).collect();
        for ends in [[a, b], [b, a]] {
            let found: Vec<_> = index.between(&contacts, ends).filter(same).collect();
            assert_eq!(found, wanted);
        }
    }
}

#[test]
fn cleared_and_shortened_lists_are_indexed_anew() {
    let mut index = KeyIndex::new();
    let many = [key(0, 0, 1, 0), key(0, 1, 1, 0)].map(Keyed);
    let few = [Keyed(key(0, 1, 1, 0))];
    assert_eq!(index.place(&many, &key(0, 1, 1, 0), 5), Some(1));
    assert_eq!(index.place(&few, &key(0, 1, 1, 0), 5), Some(0));
    index.clear();
    assert_eq!(index.place(&many, &key(0, 1, 1, 0), 5), Some(1));
    assert_eq!(index.place::<Keyed>(&[], &key(0, 1, 1, 0), 0), None);
}

#[test]
fn hashes_of_a_large_scene_are_spread() {
    let mut index = KeyIndex::new();
    let contacts: Vec<_> = (0..8192).map(|i| Keyed(key(i / 8, i % 8, 1 + i / 8, 0))).collect();
    index.0.list(&contacts, hash_of_key);
    let longest = (0..index.0.chains.len())
        .map(|slot| index.0.links.iter().filter(|link| link.0 as usize & 8191 == slot).count())
        .max();
    assert!(longest <= Some(12), "{longest:?}");
}
