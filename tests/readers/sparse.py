"""The exchange of matrices with scipy: sparse.py FACTORS.npz AREAS.csv FOLDER

Checks what our export holds, and writes the same matrix in every form that our import takes.
"""

import sys

import numpy as np
import scipy.io
import scipy.sparse as sparse

factors = sparse.load_npz(sys.argv[1])
areas = np.loadtxt(sys.argv[2], delimiter=",", skiprows=1, usecols=1)
assert sparse.isspmatrix_csr(factors) and factors.has_sorted_indices and factors.dtype == np.float64
exchange = sparse.diags(areas) @ factors
assert abs(exchange - exchange.T).max() <= 1e-12 * exchange.max(), "A F is not symmetric"
for form in "csr", "csc", "coo":
    for packed in False, True:
        sparse.save_npz(f"{sys.argv[3]}/{form}{int(packed)}.npz", factors.asformat(form), compressed=packed)
scipy.io.mmwrite(f"{sys.argv[3]}/scipy.mtx", factors, precision=17)
print("passed")
