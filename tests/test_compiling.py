import numba

from flowborne.compiling import compilation_watched


def test_kernels_are_counted_once_and_only_while_watching():
    @numba.njit
    def double(x):
        return 2 * x

    seen = []
    with compilation_watched(seen.append):
        double(1)
        double(2)
        double(1.0)
    double(1j)
    assert seen == [1, 2]
