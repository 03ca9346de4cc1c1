use super::*;
use proptest::prelude::*;

/// The Edmonds-Karp algorithm on a dense matrix, as a simple reference.
pub(in crate::kernels::seam) fn naive<const D: usize>(graph: &Graph<'_, D>) -> Cut {
    let n = graph.grid.len();
    let (source, sink) = (n, n + 1);
    let mut capacity = vec![vec![0i64; n + 2]; n + 2];
    for (p, &t) in graph.terminal.iter().enumerate() {
        let t = i64::from(t);
        capacity[source][p] += t.max(0);
        capacity[p][sink] += (-t).max(0);
        for axis in 0..D {
            if let Some(q) = graph.grid.next(graph.grid.point(p), axis) {
                let q = graph.grid.index(q);
                capacity[p][q] += i64::from(graph.forward[axis][p]);
                capacity[q][p] += i64::from(graph.backward[axis][p]);
            }
        }
    }
    let mut value = 0;
    loop {
        // Find a shortest augmenting path by breadth-first search.
        let mut from = vec![usize::MAX; n + 2];
        from[source] = source;
        let mut queue = std::collections::VecDeque::from([source]);
        while let Some(p) = queue.pop_front() {
            for q in 0..n + 2 {
                if from[q] == usize::MAX && capacity[p][q] > 0 {
                    from[q] = p;
                    queue.push_back(q);
                }
            }
        }
        if from[sink] == usize::MAX {
            break;
        }
        let path: Vec<(usize, usize)> =
            std::iter::successors(Some(sink), |&q| (from[q] != source).then(|| from[q]))
                .map(|q| (from[q], q))
                .collect();
        // Push the bottleneck along the path.
        let flow = path.iter().map(|&(p, q)| capacity[p][q]).min().unwrap();
        for (p, q) in path {
            capacity[p][q] -= flow;
            capacity[q][p] += flow;
        }
        value += flow;
    }
    // Collect the nodes that can still reach the sink.
    let mut reaches = vec![false; n + 2];
    reaches[sink] = true;
    let mut stack = vec![sink];
    while let Some(q) = stack.pop() {
        for p in 0..n {
            if !reaches[p] && capacity[p][q] > 0 {
                reaches[p] = true;
                stack.push(p);
            }
        }
    }
    reaches.truncate(n);
    Cut {
        sink: reaches,
        value,
    }
}

/// Returns the cost of a labelling, by definition.
pub(in crate::kernels::seam) fn energy<const D: usize>(graph: &Graph<'_, D>, sink: &[bool]) -> i64 {
    let mut sum = 0;
    for p in 0..graph.grid.len() {
        let t = i64::from(graph.terminal[p]);
        sum += if sink[p] { t.max(0) } else { (-t).max(0) };
        for axis in 0..D {
            if let Some(q) = graph.grid.next(graph.grid.point(p), axis) {
                match (sink[p], sink[graph.grid.index(q)]) {
                    (false, true) => sum += i64::from(graph.forward[axis][p]),
                    (true, false) => sum += i64::from(graph.backward[axis][p]),
                    _ => {}
                }
            }
        }
    }
    sum
}

#[derive(Debug, Clone)]
struct Random<const D: usize> {
    grid: Grid<D>,
    terminal: Vec<i32>,
    forward: Vec<Vec<i32>>,
    backward: Vec<Vec<i32>>,
}

impl<const D: usize> Random<D> {
    fn graph(&self) -> Graph<'_, D> {
        Graph {
            grid: self.grid,
            terminal: &self.terminal,
            forward: std::array::from_fn(|axis| &self.forward[axis][..]),
            backward: std::array::from_fn(|axis| &self.backward[axis][..]),
        }
    }
}

fn random<const D: usize>(longest: usize) -> impl Strategy<Value = Random<D>> {
    let shape = prop::collection::vec(1..=longest, D);
    let wrap = prop::collection::vec(any::<bool>(), D);
    (shape, wrap, 1i32..20, 1i32..20).prop_flat_map(|(shape, wrap, t, c)| {
        let grid = Grid::new(
            std::array::from_fn(|a| shape[a]),
            std::array::from_fn(|a| wrap[a]),
        )
        .unwrap();
        let n = grid.len();
        let arcs =
            || prop::collection::vec(prop::collection::vec((-c..=c).prop_map(|x| x.max(0)), n), D);
        // Many points have no terminal, as in a seam.
        let terminal = (-3 * t..=3 * t).prop_map(move |x| if x.abs() > t { 0 } else { x });
        (prop::collection::vec(terminal, n), arcs(), arcs()).prop_map(
            move |(terminal, forward, backward)| Random {
                grid,
                terminal,
                forward,
                backward,
            },
        )
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn equals_the_naive_twin_in_two_dimensions(r in random::<2>(7)) {
        prop_assert_eq!(min_cut(&r.graph(), &Monitor::default()).unwrap(), naive(&r.graph()));
    }

    #[test]
    fn equals_the_naive_twin_in_three_dimensions(r in random::<3>(4)) {
        prop_assert_eq!(min_cut(&r.graph(), &Monitor::default()).unwrap(), naive(&r.graph()));
    }

    #[test]
    fn no_labelling_of_a_small_grid_is_cheaper(r in random::<2>(3)) {
        let cut = min_cut(&r.graph(), &Monitor::default()).unwrap();
        let n = r.grid.len();
        let least = (0..1u32 << n)
            .map(|bits| energy(&r.graph(), &(0..n).map(|i| bits >> i & 1 == 1).collect::<Vec<_>>()))
            .min();
        prop_assert_eq!(least, Some(cut.value));
        prop_assert_eq!(energy(&r.graph(), &cut.sink), cut.value);
    }

    #[test]
    fn a_used_workspace_gives_the_same_cut(a in random::<2>(6), b in random::<2>(6)) {
        let mut solver = Solver::default();
        solver.min_cut(&a.graph(), &Monitor::default()).unwrap();
        let again = solver.min_cut(&b.graph(), &Monitor::default()).unwrap();
        prop_assert_eq!(again, min_cut(&b.graph(), &Monitor::default()).unwrap());
    }
}

#[test]
fn refuses_what_would_overflow_or_does_not_fit() {
    let grid = Grid::new([1, 2], [false; 2]).unwrap();
    let solve = |forward: i32, backward: i32, terminals: usize| {
        let (f, b) = ([forward; 2], [backward; 2]);
        let graph = Graph {
            grid,
            terminal: &[1, -1, 0][..terminals],
            forward: [&f, &f],
            backward: [&b, &b],
        };
        min_cut(&graph, &Monitor::default())
    };
    assert!(solve(i32::MAX, 1, 2).is_err());
    assert!(solve(-1, 1, 2).is_err());
    assert!(solve(1, 1, 3).is_err());
    assert_eq!(solve(i32::MAX, 0, 2).unwrap().value, 1);
}

#[test]
fn the_least_number_is_a_capacity() {
    for shape in [[1, 2], [2, 1]] {
        let (f, b) = ([i32::MAX; 2], [0; 2]);
        for terminal in [[i32::MAX, i32::MIN], [5, i32::MIN], [i32::MIN; 2]] {
            let graph = Graph {
                grid: Grid::new(shape, [false; 2]).unwrap(),
                terminal: &terminal,
                forward: [&f, &f],
                backward: [&b, &b],
            };
            let found = min_cut(&graph, &Monitor::default()).unwrap();
            assert_eq!(found.value, i64::from(terminal[0].max(0)));
        }
    }
}

#[test]
fn a_cancelled_monitor_stops_the_search() {
    let grid = Grid::new([1, 2], [false; 2]).unwrap();
    let graph = Graph {
        grid,
        terminal: &[1, -1],
        forward: [&[1, 1], &[1, 1]],
        backward: [&[1, 1], &[1, 1]],
    };
    let monitor = Monitor::default();
    monitor.cancel();
    assert!(matches!(
        min_cut(&graph, &monitor),
        Err(Error::Cancelled(_))
    ));
}
