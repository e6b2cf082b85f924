"""BIFS scenes (ISO/IEC 14496-1): what BT and XMT-A, their two text forms, have in common."""
