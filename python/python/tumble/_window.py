"""A window for images of a simulation. It needs the package pygame."""

from __future__ import annotations

import os
from typing import Any

from ._tumble import TumbleError


class Window:
    """Window that shows images at a fixed rate. It stays closed once the user has closed it.

    :param rate: images per second; ``show`` waits until the next one is due.
    """

    def __init__(self, title: str, rate: int) -> None:
        os.environ.setdefault("PYGAME_HIDE_SUPPORT_PROMPT", "1")
        try:
            import pygame
        except ImportError:
            raise TumbleError(
                'render_mode is "human", which needs pygame; install it with pip install pygame'
            ) from None
        self._pygame = pygame
        self._title, self._rate = title, rate
        self._surface: Any | None = None
        self._is_closed = False

    def show(self, image: Any) -> None:
        """Shows an image, (height, width, 3)."""
        if self._is_closed:
            return
        pygame = self._pygame
        if self._surface is None:
            pygame.init()
            pygame.display.set_caption(self._title)
            self._surface = pygame.display.set_mode(image.shape[1::-1])
            self._clock = pygame.time.Clock()
        self._surface.blit(pygame.surfarray.make_surface(image.swapaxes(0, 1)), (0, 0))
        pygame.display.flip()
        self._clock.tick(self._rate)
        if any(event.type == pygame.QUIT for event in pygame.event.get()):
            self.close()

    def close(self) -> None:
        """Closes the window."""
        if self._surface is not None:
            self._pygame.display.quit()
            self._surface = None
        self._is_closed = True
