"""The top line: where one is; a click goes back."""

from __future__ import annotations

from textual.widgets import Static

from olivevib.tui.harmless import harmless


class Title(Static):
    """``‹ olivevib › T04 › results``; a click on it goes back, as Esc does."""

    def __init__(self, *parts: str, back: bool = True) -> None:
        super().__init__(id="title", markup=False)
        self._back = back
        self.say(*parts)

    def say(self, *parts: str) -> None:
        """Show another place."""
        where = " › ".join(harmless(p, 60) for p in ("olivevib", *parts) if p)
        self.update(f"‹ {where}" if self._back else where)

    async def on_click(self) -> None:
        """Go back."""
        await self.screen.run_action("back")
