//! Disjoint sets of numbered elements: every set is a tree, and its root stands for it.

/// The root of the set of an element, with shorter paths afterwards.
pub(super) fn root(parents: &mut [u32], mut i: u32) -> u32 {
    while parents[i as usize] != i {
        let next = parents[i as usize];
        parents[i as usize] = parents[next as usize];
        i = next;
    }
    i
}

/// Unites the sets of two elements; the smaller root stays.
pub(super) fn unite(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    parents[a.max(b) as usize] = a.min(b);
}
