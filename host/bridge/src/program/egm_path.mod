MODULE {name}
  ! Path correction (EGM, option 689-1): the path is here, this computer sends the correction across it.
  ! Once, in Configuration, Communication, Transmission Protocol: name UCdevice, type UDPUC,
  ! remote address {host}, remote port {port}. External Motion Interface Data: name "path_corr", level "Path".
  ! Never run on a real robot by the authors. First at 10 % speed, in manual mode, with nothing in reach:
  ! the first thing to see is on which side of the path a correction acts, and whether it adds up.
  PERS tooldata tGiotto := [TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,50],[1,0,0,0],0,0,0]];
  ! The table holds in this work object.
  PERS wobjdata wGiotto := [FALSE,TRUE,"",[[0,0,0],[1,0,0,0]],[[0,0,0],[1,0,0,0]]];
  ! A circle of 100 mm radius about pCentre, from its side in +X: pCentre is to be taught.
  CONST robtarget pCentre := [[0,0,0],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]];
  LOCAL VAR egmident egmID;

  PROC main()
    VAR pose sensor := [[0,0,0],[1,0,0,0]];
    MoveL Offs(pCentre,100,0,0), v20, fine, tGiotto \WObj:=wGiotto;
    EGMReset egmID;
    EGMGetId egmID;
    EGMSetupUC ROB_1, egmID, "path_corr", "UCdevice" \PathCorr \APTR;
    EGMActMove egmID, sensor \SampleRate:={cycle};
    FOR lap FROM 1 TO 3 DO
      EGMMoveC egmID, Offs(pCentre,0,100,0), Offs(pCentre,-100,0,0), v20, z1, tGiotto \WObj:=wGiotto;
      EGMMoveC egmID, Offs(pCentre,0,-100,0), Offs(pCentre,100,0,0), v20, z1, tGiotto \WObj:=wGiotto;
    ENDFOR
    MoveL Offs(pCentre,100,0,0), v20, fine, tGiotto \WObj:=wGiotto;
    EGMReset egmID;
  ERROR
    EGMReset egmID;
    Stop;
  ENDPROC
ENDMODULE
