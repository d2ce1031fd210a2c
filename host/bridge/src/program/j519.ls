/PROG  {NAME}
/ATTR
COMMENT		= "giotto j519";
PROTECT		= READ_WRITE;
DEFAULT_GROUP	= 1,*,*,*,*;
/APPL
/MN
   1:  !Stream motion (J519): {name} plans ;
   2:  !the path and sends set-points ;
   3:  !to UDP 60015 every {cycle} ms ;
   4:  !Never run on a real robot ;
   5:  !by the authors ;
   6:  !First in T1 at 10 % ;
   7:  !P[1]: first row of the path ;
   8:  UFRAME_NUM=1 ;
   9:  UTOOL_NUM=1 ;
  10:L P[1] 20mm/sec FINE    ;
  11:  !IBGN start waits for giotto ;
  12:  !bridge; IBGN end ends with it ;
  13:  IBGN start[1] ;
  14:  IBGN end[1] ;
/POS
P[1]{
   GP1:
	UF : 1, UT : 1,		CONFIG : 'N U T, 0, 0, 0',
	X =     0.000  mm,	Y =     0.000  mm,	Z =     0.000  mm,
	W =   180.000 deg,	P =     0.000 deg,	R =     0.000 deg
};
/END
