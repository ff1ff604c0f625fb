"""CUDA kernels around the loops of `root_loops`: they lay segments out and collect results, a thread each."""

from __future__ import annotations

from ..kernel.cuda_stubs import kernel, real, thread


@kernel
def lay(E, ox, oy, oz, h, R, S, n):
    """Lay grid edges out as segments.

    Parameters
    ----------
    E : array of int16, shape (n or more, 4)
        Lower grid point and axis of each edge.
    ox, oy, oz, h : float
        Position of grid point (0, 0, 0), and grid spacing, scene units.
    R, S : array of float64 and of float32, shape (6, n or more)
        Receive the segments.
    n : int
        Number of edges.
    """
    i = thread()
    if i < n:
        R[0, i] = ox + h * real(E[i, 0])
        R[1, i] = oy + h * real(E[i, 1])
        R[2, i] = oz + h * real(E[i, 2])
        for k in range(3):
            R[3 + k, i] = h if E[i, 3] == k else real(0)
        for k in range(6):
            S[k, i] = R[k, i]


@kernel
def start(U, T, n):
    """Start `polish` from the roots of `find`.

    Parameters
    ----------
    U : array of float32 or float64
        Roots of `find`.
    T : array of float64
        Receives them.
    n : int
        Number of segments.
    """
    i = thread()
    if i < n:
        T[i] = U[i]


@kernel
def collect(U, T, D, sure, N, F, n):
    """Collect results of `polish`; where a root is not exact, that of `find` stays.

    Parameters
    ----------
    U : array of float32 or float64
        Roots of `find`.
    T : array of float64
        Roots of `polish`, modified in place.
    D : array of float64, shape (4, n or more)
        Unit normals, and lengths of Newton's last step as fractions of the segments.
    sure : float
        Length of a step below which a root is exact.
    N : array of float32, shape (3, n or more)
        Receives the normals.
    F : array of uint8
        Receives 1 for roots that are not exact, else 0.
    n : int
        Number of segments.
    """
    i = thread()
    if i < n:
        for k in range(3):
            N[k, i] = D[k, i]
        F[i] = 0
        if not D[3, i] <= sure:
            F[i] = 1
            T[i] = U[i]


LOOPS = lay, start, collect
