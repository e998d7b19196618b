"""CRC-16/IBM-3740 (also called CCITT-FALSE): what guards every packet on the link."""

from __future__ import annotations

import binascii


def crc16(data: bytes) -> int:
    """Polynomial 0x1021, start value 0xFFFF, not reflected, no final inversion.

    The check value of this CRC is 0x29B1, for the ASCII digits 1 to 9.
    """
    return binascii.crc_hqx(data, 0xFFFF)
