"""Tables as columns by name. pandas, whose import takes longer than a short comparison, makes the table on request."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas as pd

Columns = Mapping[str, NDArray[Any]]
"""arrays (n,) of equal length by name"""


def to_frame(columns: Columns, index: str | None = None) -> "pd.DataFrame":
    """The table of the columns, with rows from 0; `index` names them."""
    import pandas as pd

    return pd.DataFrame(dict(columns)).rename_axis(index)


def of_frame(table: "pd.DataFrame") -> Columns:
    """The columns of a table, without its index."""
    return {str(name): table[name].to_numpy() for name in table.columns}
